//! Addresses of the page: its files, the textures, and the stream.

use std::sync::Arc;
use std::sync::atomic::Ordering;

use axum::Router;
use axum::extract::ws::WebSocketUpgrade;
use axum::extract::ws::rejection::WebSocketUpgradeRejection;
use axum::extract::{Path, State};
use axum::http::{HeaderMap, StatusCode, header};
use axum::response::{IntoResponse, Redirect, Response};
use axum::routing::get;

use crate::from_page::MESSAGE_MAX;
use crate::site::Site;
use crate::viewer::attend;

/// Largest number of open pages.
const VIEWERS_MAX: usize = 8;

/// Content security policy: the page may run its own scripts and connect to its own server.
const POLICY: &str = "default-src 'none'; script-src 'self'; style-src 'self'; connect-src 'self'; \
                      img-src 'self' data:; base-uri 'none'; form-action 'none'; \
                      frame-ancestors 'none'";

/// Files of the page: name, content type, text.
const FILES: [(&str, &str, &str); 10] = [
    ("index.html", "text/html; charset=utf-8", include_str!("../page/index.html")),
    ("style.css", "text/css; charset=utf-8", include_str!("../page/style.css")),
    ("main.js", SCRIPT, include_str!("../page/main.js")),
    ("stream.js", SCRIPT, include_str!("../page/stream.js")),
    ("scene.js", SCRIPT, include_str!("../page/scene.js")),
    ("shaders.js", SCRIPT, include_str!("../page/shaders.js")),
    ("eye.js", SCRIPT, include_str!("../page/eye.js")),
    ("headset.js", SCRIPT, include_str!("../page/headset.js")),
    ("board.js", SCRIPT, include_str!("../page/board.js")),
    ("card.js", SCRIPT, include_str!("../page/card.js")),
];
const SCRIPT: &str = "text/javascript; charset=utf-8";

/// Router from addresses to responses.
pub fn routes(site: Arc<Site>) -> Router {
    Router::new()
        .route("/{token}", get(without_slash))
        .route("/{token}/", get(page))
        .route("/{token}/stream", get(stream))
        .route("/{token}/texture/{number}", get(texture))
        .route("/{token}/{file}", get(file))
        .fallback(refused)
        .with_state(site)
}

async fn refused() -> Response {
    let text = "403: open the whole address that glove-client printed, with its token\n";
    with_headers((StatusCode::FORBIDDEN, text).into_response())
}

async fn without_slash(State(site): State<Arc<Site>>, Path(token): Path<String>) -> Response {
    match site.token.is(&token) {
        true => Redirect::permanent(&format!("/{token}/")).into_response(),
        false => refused().await,
    }
}

async fn page(State(site): State<Arc<Site>>, Path(token): Path<String>) -> Response {
    named(&site, &token, "index.html").await
}

async fn file(
    State(site): State<Arc<Site>>,
    Path((token, file)): Path<(String, String)>,
) -> Response {
    named(&site, &token, &file).await
}

async fn named(site: &Site, token: &str, file: &str) -> Response {
    if !site.token.is(token) {
        return refused().await;
    }
    match FILES.iter().find(|(name, ..)| *name == file) {
        Some((_, kind, text)) => {
            with_headers(([(header::CONTENT_TYPE, *kind)], *text).into_response())
        }
        None => {
            with_headers((StatusCode::NOT_FOUND, "404: there is no such file\n").into_response())
        }
    }
}

async fn texture(
    State(site): State<Arc<Site>>,
    Path((token, number)): Path<(String, u32)>,
) -> Response {
    if !site.token.is(&token) {
        return refused().await;
    }
    match site.textures.get(number) {
        Some(packed) => {
            let kind = (header::CONTENT_TYPE, "application/octet-stream");
            let packing = (header::CONTENT_ENCODING, "gzip");
            with_headers(([kind, packing], packed.to_vec()).into_response())
        }
        None => with_headers((StatusCode::NOT_FOUND, "404: no such picture\n").into_response()),
    }
}

async fn stream(
    State(site): State<Arc<Site>>,
    Path(token): Path<String>,
    headers: HeaderMap,
    upgrade: Result<WebSocketUpgrade, WebSocketUpgradeRejection>,
) -> Response {
    if !site.token.is(&token) || is_from_elsewhere(&headers) {
        return refused().await;
    }
    let Ok(upgrade) = upgrade else {
        let text = "400: the stream is a WebSocket\n";
        return with_headers((StatusCode::BAD_REQUEST, text).into_response());
    };
    if site.viewers.load(Ordering::Relaxed) >= VIEWERS_MAX {
        let text = "503: as many pages look as can; close one\n";
        return with_headers((StatusCode::SERVICE_UNAVAILABLE, text).into_response());
    }
    let number = site.numbers.fetch_add(1, Ordering::Relaxed);
    upgrade
        .max_message_size(MESSAGE_MAX)
        .max_frame_size(MESSAGE_MAX)
        .on_upgrade(move |socket| attend(socket, site, number))
}

/// Whether the request comes from a page of another origin.
fn is_from_elsewhere(headers: &HeaderMap) -> bool {
    let text = |name| headers.get(name).and_then(|value: &header::HeaderValue| value.to_str().ok());
    let Some(origin) = text(header::ORIGIN) else { return false };
    let authority = origin.split_once("://").map(|(_, authority)| authority);
    authority != text(header::HOST)
}

fn with_headers(mut response: Response) -> Response {
    let headers = response.headers_mut();
    let all = [
        (header::CONTENT_SECURITY_POLICY, POLICY),
        (header::REFERRER_POLICY, "no-referrer"),
        (header::X_CONTENT_TYPE_OPTIONS, "nosniff"),
        (header::CACHE_CONTROL, "no-store"),
    ];
    for (name, value) in all {
        headers.insert(name, header::HeaderValue::from_static(value));
    }
    response
}
