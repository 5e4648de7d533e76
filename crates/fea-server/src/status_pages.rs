//! The pages about the server's state, by HTTP: `/metrics`, `/health`, `/ready`.
//!
//! For monitors and load balancers: one short request for each connection, of which only the first line
//! is used.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use tokio::io::{AsyncRead, AsyncReadExt, AsyncWrite, AsyncWriteExt};
use tokio::net::TcpListener;
use tokio::time::timeout;

use crate::machine_memory::resident_bytes;
use crate::metrics::Gauges;
use crate::pace::Pace;
use crate::resources::Resources;
use crate::server_handle::ServerHandle;
use crate::strangers::Strangers;

/// Server that the pages tell of.
#[derive(Clone)]
pub(crate) struct StatusPages {
    server: ServerHandle,
    /// Whether the server is stopping and accepts no more sessions.
    is_stopping: Arc<AtomicBool>,
    /// Connections that have not sent their request yet, or not taken their page.
    readers: Strangers,
}

/// Largest length of a request's head, bytes.
const HEAD_MAX: usize = 8 * 1024;
/// Longest time for the request to come and its page to be taken.
const PAGE_MAX: Duration = Duration::from_secs(5);
/// Largest number of connections; a further one takes the room of the oldest.
const READERS_MAX: usize = 64;
/// Pause after a failed `accept`.
const ACCEPT_PAUSE: Duration = Duration::from_millis(50);

/// Status line and text of a page.
#[derive(Debug, PartialEq, Eq)]
struct Page {
    status: &'static str,
    text: String,
}

impl StatusPages {
    /// Pages of a server.
    pub fn new(server: ServerHandle, is_stopping: Arc<AtomicBool>) -> Self {
        Self { server, is_stopping, readers: Strangers::new(READERS_MAX) }
    }

    /// Serves the pages until it is dropped. A connection that sends or takes nothing is closed when
    /// others need its room.
    pub async fn serve(self, listener: TcpListener) {
        let mut pace = Pace::of_connections(Instant::now());
        loop {
            tokio::time::sleep_until(pace.next().into()).await;
            let Ok((stream, peer)) = listener.accept().await else {
                self.readers.send_one_away();
                tokio::time::sleep(ACCEPT_PAUSE).await;
                continue;
            };
            pace.came(Instant::now());
            let (pages, guest) = (self.clone(), self.readers.let_in(peer.ip()));
            tokio::spawn(async move {
                tokio::select! {
                    // Whoever asks too slowly, or goes, has no page.
                    _ = timeout(PAGE_MAX, pages.answer(stream)) => {}
                    () = guest.is_to_go() => {}
                }
            });
        }
    }

    async fn answer(&self, mut stream: impl AsyncRead + AsyncWrite + Unpin) -> std::io::Result<()> {
        let head = read_head(&mut stream).await?;
        let Page { status, text } = self.page(&head);
        let is_head_only = head.starts_with(b"HEAD ");
        let answer = format!(
            "HTTP/1.1 {status}\r\nContent-Type: text/plain; version=0.0.4; charset=utf-8\r\n\
             Content-Length: {}\r\nConnection: close\r\n\r\n{}",
            text.len(),
            if is_head_only { "" } else { &text }
        );
        stream.write_all(answer.as_bytes()).await?;
        stream.shutdown().await
    }

    fn page(&self, head: &[u8]) -> Page {
        let line = head.split(|byte| *byte == b'\r' || *byte == b'\n').next().unwrap_or_default();
        let mut words = line.split(|byte| *byte == b' ');
        let (method, target) = (words.next().unwrap_or_default(), words.next().unwrap_or_default());
        let path = target.split(|byte| *byte == b'?').next().unwrap_or_default();
        let page = |status, text: String| Page { status, text };
        match (method, path) {
            (b"GET" | b"HEAD", b"/health") => page("200 OK", "alive\n".to_owned()),
            (b"GET" | b"HEAD", b"/ready") => match self.not_ready() {
                None => page("200 OK", "ready\n".to_owned()),
                Some(why) => page("503 Service Unavailable", format!("{why}\n")),
            },
            (b"GET" | b"HEAD", b"/metrics") => {
                let is_ready = self.not_ready().is_none();
                let gauges = gauges(&self.server, is_ready);
                page("200 OK", self.server.resources.metrics.text(&gauges))
            }
            (b"GET" | b"HEAD", _) => {
                page("404 Not Found", "there are /metrics, /health and /ready\n".to_owned())
            }
            _ => page("405 Method Not Allowed", "only GET and HEAD\n".to_owned()),
        }
    }

    /// Why no new session would be accepted; `None` if one would.
    fn not_ready(&self) -> Option<&'static str> {
        let max = self.server.resources.config.max_sessions;
        match self.is_stopping.load(Ordering::Relaxed) {
            true => Some("stopping"),
            false => (self.server.places.taken() >= max).then_some("all sessions are taken"),
        }
    }
}

/// Present values of the gauges of a server.
pub(crate) fn gauges(server: &ServerHandle, is_ready: bool) -> Gauges {
    let ServerHandle { resources, places, strangers, .. } = server;
    let Resources { models, budget, workers, .. } = &**resources;
    let (count, bytes) = models.count_and_bytes();
    Gauges {
        sessions: places.taken(),
        strangers: strangers.count(),
        queued: workers.queued(),
        models: count,
        models_bytes: bytes,
        reserved_bytes: budget.limit() - budget.left_for_kept(),
        limit_bytes: budget.limit(),
        resident_bytes: resident_bytes(),
        is_ready,
        certificate_expires_s: resources
            .config
            .encryption
            .as_ref()
            .map(|e| e.validity().expires_s()),
        tokens: resources.access.numbers(),
    }
}

/// Bytes up to the empty line after a request's head, or as many as are read at most.
async fn read_head(stream: &mut (impl AsyncRead + Unpin)) -> std::io::Result<Vec<u8>> {
    let mut head = Vec::new();
    let mut piece = [0; 1024];
    while head.len() < HEAD_MAX && !head.windows(4).any(|four| four == b"\r\n\r\n") {
        let count = stream.read(&mut piece).await?;
        if count == 0 {
            break;
        }
        head.extend_from_slice(piece.get(..count).unwrap_or_default());
    }
    Ok(head)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::ServerConfig;
    use crate::workers::Workers;

    fn pages() -> StatusPages {
        let config = ServerConfig { threads: 1, max_sessions: 1, ..ServerConfig::default() };
        let workers = Workers::new(1, 1).unwrap();
        let (_, stop) = tokio::sync::watch::channel(false);
        StatusPages::new(ServerHandle::new(config, workers, stop), Arc::default())
    }

    #[test]
    fn server_is_ready_until_it_stops_or_is_full() {
        let pages = pages();
        let status =
            |target: &str| pages.page(format!("GET {target} HTTP/1.1\r\n").as_bytes()).status;
        assert_eq!(status("/ready"), "200 OK");
        let place = pages.server.places.take([127, 0, 0, 1].into()).unwrap();
        assert_eq!(status("/ready?x=1"), "503 Service Unavailable");
        assert_eq!(status("/health"), "200 OK");
        drop(place);
        assert_eq!(status("/ready"), "200 OK");
        pages.is_stopping.store(true, Ordering::Relaxed);
        assert_eq!(status("/ready"), "503 Service Unavailable");
        assert_eq!(status("/"), "404 Not Found");
        assert_eq!(status("/metrics"), "200 OK");
        assert_eq!(pages.page(b"POST /metrics HTTP/1.1\r\n").status, "405 Method Not Allowed");
        assert_eq!(pages.page(b"").status, "405 Method Not Allowed");
    }

    #[tokio::test]
    async fn request_in_pieces_gets_a_whole_answer_and_garbage_as_well() {
        for (request, begins) in [
            (&b"GET /health HTTP/1.1\r\nHost: a\r\n\r\n"[..], "HTTP/1.1 200 OK\r\n"),
            (b"GET /nowhere HTTP/1.1\r\n\r\n", "HTTP/1.1 404 "),
            (b"\xff\xfe\r\n\r\n", "HTTP/1.1 405 "),
        ] {
            let (mut client, server) = tokio::io::duplex(64);
            let pages = pages();
            let asks = async {
                for piece in request.chunks(7) {
                    client.write_all(piece).await.unwrap();
                    tokio::task::yield_now().await;
                }
                let mut answer = Vec::new();
                client.read_to_end(&mut answer).await.unwrap();
                String::from_utf8(answer).unwrap()
            };
            let (answer, served) = tokio::join!(asks, pages.answer(server));
            served.unwrap();
            assert!(answer.starts_with(begins), "{answer}");
        }
    }

    #[tokio::test]
    async fn head_without_an_end_is_not_read_for_ever() {
        let endless = tokio::io::repeat(b'a');
        let mut both = tokio::io::join(endless, tokio::io::sink());
        let head = read_head(&mut both).await.unwrap();
        assert!((HEAD_MAX..HEAD_MAX + 1024).contains(&head.len()));
    }
}
