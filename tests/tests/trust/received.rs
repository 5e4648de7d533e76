//! Requests that are being received take memory from the limit: a crowd that sends large ones stays
//! within it, and is refused or served, never both and never neither.

use std::time::Duration;

use fea_server::{LocalServer, ServerConfig};
use softgrasp_protocol::asynchronous::Connection;
use softgrasp_protocol::{Limits, MeshData, RejectCode, Rejected, Reply, Request, UploadModel};
use softgrasp_tests::questions::{cube, once, upload};
use softgrasp_tests::raw_session::request_frame;
use softgrasp_tests::watchdog::within;
use tokio::io::DuplexStream;

use crate::start::config;

const LIMIT: Duration = Duration::from_secs(120);
const MEMORY: u64 = 8 << 20;
const CROWD: usize = 8;

fn number(metrics: &str, name: &str) -> f64 {
    metrics.lines().find_map(|line| line.strip_prefix(name)?.trim().parse().ok()).unwrap()
}

/// Request of `bytes` bytes that is refused for its number of nodes, after it was received and read.
fn request_of(bytes: usize) -> Vec<u8> {
    let vertices = vec![[0.0; 3]; bytes / 24];
    let model =
        UploadModel { mesh: MeshData { vertices, ..MeshData::default() }, ..upload(&cube(27)) };
    request_frame(1, &Request::UploadModel(model))
}

async fn code(connection: &mut Connection<DuplexStream>) -> RejectCode {
    let frame = connection.read_frame().await.unwrap().expect("a reply");
    match Reply::decode(&frame, &Limits::default()).unwrap() {
        Reply::Rejected(Rejected { code, .. }) => code,
        other => panic!("{other:?}"),
    }
}

fn run(test: impl Future<Output = ()> + Send + 'static) {
    within(LIMIT, "a crowd that sends", || {
        let runtime =
            tokio::runtime::Builder::new_current_thread().enable_all().start_paused(true).build();
        runtime.unwrap().block_on(test);
    });
}

#[test]
fn crowd_that_sends_large_requests_stays_within_the_limit() {
    run(async {
        let config = ServerConfig { memory_limit: MEMORY, max_nodes: 1000, ..config(1) };
        let server = std::sync::Arc::new(LocalServer::new(config).unwrap());
        // Three of them fit beside each other, and one of them while it is read.
        let bytes = request_of(MEMORY as usize * 2 / 5);
        let mut clients = tokio::task::JoinSet::new();
        for _ in 0..CROWD {
            let (stream, serves) = server.connect().unwrap();
            tokio::spawn(serves);
            let bytes = bytes.clone();
            clients.spawn(async move {
                let mut connection = Connection::new(stream, Limits::default());
                let mut replies = Vec::new();
                for _ in 0..2 {
                    connection.write_bytes(&bytes).await.unwrap();
                    replies.push(code(&mut connection).await);
                }
                // Whatever was passed over, what follows is whole. While the others send, there may be no
                // memory left for it; that is said, and it is asked again.
                let small = Request::from(once(&cube(27), "sparse-cholesky"));
                for id in 2.. {
                    connection.write_bytes(&request_frame(id, &small)).await.unwrap();
                    let frame = connection.read_frame().await.unwrap().expect("an answer");
                    match Reply::decode(&frame, &Limits::default()).unwrap() {
                        Reply::Answer(_) => break,
                        Reply::Rejected(Rejected { code: RejectCode::MemoryLimit, .. }) => {
                            tokio::time::sleep(Duration::from_millis(100)).await;
                        }
                        other => panic!("{other:?}"),
                    }
                }
                replies
            });
        }
        let (mut most, mut all) = (0.0f64, Vec::new());
        while !clients.is_empty() {
            let reserved = number(&server.metrics(), "softgrasp_reserved_bytes ");
            assert!(reserved <= MEMORY as f64, "{reserved} bytes are reserved");
            most = most.max(reserved);
            tokio::select! {
                biased;
                Some(replies) = clients.join_next() => all.extend(replies.unwrap()),
                // The clock stands still while anything is to be done.
                () = tokio::time::sleep(Duration::from_millis(1)) => {}
            }
        }
        assert!(most > MEMORY as f64 / 2.0, "at most {most} bytes were reserved");
        let refused = all.iter().filter(|code| **code == RejectCode::MemoryLimit).count();
        let read = all.iter().filter(|code| **code == RejectCode::TooLarge).count();
        assert_eq!(refused + read, 2 * CROWD, "{all:?}");
        assert!(read > 0, "nobody was served");
        assert_eq!(number(&server.metrics(), "softgrasp_reserved_bytes "), 0.0);
    });
}

#[test]
fn request_larger_than_the_memory_is_refused_by_its_header() {
    run(async {
        let config = ServerConfig { memory_limit: MEMORY, ..config(1) };
        let server = LocalServer::new(config).unwrap();
        let (stream, serves) = server.connect().unwrap();
        tokio::spawn(serves);
        let mut connection = Connection::new(stream, Limits::default());
        let bytes = request_of(MEMORY as usize);
        // Its first bytes suffice; the rest is passed over.
        let (first, rest) = bytes.split_at(100);
        connection.write_bytes(first).await.unwrap();
        assert_eq!(code(&mut connection).await, RejectCode::MemoryLimit);
        assert_eq!(number(&server.metrics(), "softgrasp_reserved_bytes "), 0.0);
        connection.write_bytes(rest).await.unwrap();
        let ping = request_frame(3, &Request::Ping { nonce: 5 });
        connection.write_bytes(&ping).await.unwrap();
        let frame = connection.read_frame().await.unwrap().expect("a reply");
        let reply = Reply::decode(&frame, &Limits::default()).unwrap();
        assert_eq!((frame.request_id(), reply), (3, Reply::Pong { nonce: 5 }));
    });
}
