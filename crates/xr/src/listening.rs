//! Accepts connections for the page: at most so many at a time, each within a time limit, encrypted or
//! not.

use std::sync::Arc;
use std::time::Duration;

use axum::Router;
use hyper::server::conn::http1;
use hyper_util::rt::{TokioIo, TokioTimer};
use hyper_util::service::TowerToHyperService;
use tokio::io::{AsyncRead, AsyncWrite};
use tokio::net::TcpListener;
use tokio::sync::{Semaphore, watch};
use tokio::time::timeout;
use tokio_rustls::TlsAcceptor;

/// Largest number of connections that ask for files at a time; streams of open pages are not among them.
const CONNECTIONS_MAX: usize = 48;
/// Longest time for a request, and for the TLS handshake.
const REQUEST_MAX: Duration = Duration::from_secs(10);
/// Pause after a failed `accept`.
const ACCEPT_PAUSE: Duration = Duration::from_millis(50);

/// Serves until the run is over.
pub async fn serve(
    listener: TcpListener,
    encryption: Option<TlsAcceptor>,
    routes: Router,
    mut over: watch::Receiver<bool>,
) {
    let room = Arc::new(Semaphore::new(CONNECTIONS_MAX));
    loop {
        let accepted = tokio::select! {
            accepted = listener.accept() => accepted,
            _ = over.changed() => return,
        };
        let Ok((stream, _)) = accepted else {
            tokio::time::sleep(ACCEPT_PAUSE).await;
            continue;
        };
        // Where there is no room the connection is closed, and the browser tries again.
        let Ok(place) = Arc::clone(&room).try_acquire_owned() else { continue };
        let (encryption, routes) = (encryption.clone(), routes.clone());
        tokio::spawn(async move {
            let _place = place;
            // A picture that waits for another is older when it comes.
            let _ = stream.set_nodelay(true);
            match encryption {
                None => answer(stream, routes).await,
                Some(acceptor) => {
                    if let Ok(Ok(stream)) = timeout(REQUEST_MAX, acceptor.accept(stream)).await {
                        answer(stream, routes).await;
                    }
                }
            }
        });
    }
}

async fn answer(stream: impl AsyncRead + AsyncWrite + Unpin + Send + 'static, routes: Router) {
    let served = http1::Builder::new()
        .timer(TokioTimer::new())
        .header_read_timeout(REQUEST_MAX)
        .serve_connection(TokioIo::new(stream), TowerToHyperService::new(routes))
        .with_upgrades()
        .await;
    if let Err(error) = served {
        tracing::debug!(%error, "a connection to the page ended");
    }
}
