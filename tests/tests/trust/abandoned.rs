//! Work of clients that have gone: it is not begun, or ended between two stages, and its memory is given
//! back.

use std::io::Write;
use std::net::{SocketAddr, TcpStream};
use std::time::Duration;

use fea_server::{LocalServer, ServerConfig};
use softgrasp_protocol::Request;
use softgrasp_tests::questions::{cube, once};
use softgrasp_tests::raw_session::request_frame;
use softgrasp_tests::watchdog::within;
use tokio::io::AsyncWriteExt;

use crate::start::{answer, client, config, server};

const LIMIT: Duration = Duration::from_secs(120);

fn number(metrics: &str, name: &str) -> f64 {
    metrics.lines().find_map(|line| line.strip_prefix(name)?.trim().parse().ok()).unwrap()
}

#[test]
fn request_whose_client_has_gone_is_counted_and_gives_its_memory_back() {
    within(LIMIT, "gone clients", || {
        let runtime =
            tokio::runtime::Builder::new_current_thread().enable_all().start_paused(true).build();
        runtime.unwrap().block_on(async {
            let server = LocalServer::new(config(1)).unwrap();
            let request = Request::from(once(&cube(216), "gauss-jordan-plain"));
            let bytes = request_frame(1, &request);
            for _ in 0..5 {
                let (mut client, serves) = server.connect().unwrap();
                let served = tokio::spawn(serves);
                client.write_all(&bytes).await.unwrap();
                // The session takes the request before it sees the end.
                tokio::task::yield_now().await;
                drop(client);
                served.await.unwrap();
            }
            while number(&server.metrics(), "softgrasp_queued_requests ") > 0.0 {
                std::thread::yield_now();
            }
            let metrics = server.metrics();
            assert_eq!(number(&metrics, "softgrasp_abandoned_total "), 5.0);
            assert_eq!(number(&metrics, "softgrasp_reserved_bytes "), 0.0);
            assert_eq!(number(&metrics, "softgrasp_sessions "), 0.0);
        });
    });
}

#[test]
fn client_that_has_closed_its_side_still_gets_its_reply() {
    use softgrasp_tests::raw_session::RawSession;
    let server = server(1);
    let mut session = RawSession::open(server.address());
    let request = Request::from(once(&cube(343), "dense-cholesky"));
    session.send(&request_frame(7, &request));
    session.finish();
    let (id, _) = session.reply().expect("a reply");
    assert_eq!(id, 7);
    assert!(session.reply().is_none());
}

#[test]
fn clients_that_reset_their_connections_during_long_work_leave_the_server_free() {
    within(LIMIT, "resets", || {
        let metrics = Some(SocketAddr::from(([127, 0, 0, 1], 0)));
        let server = fea_server::start(ServerConfig { metrics, ..config(1) }).unwrap();
        let long = Request::from(once(&cube(729), "gauss-jordan-plain"));
        let bytes = request_frame(1, &long);
        for _ in 0..40 {
            let mut stream = TcpStream::connect(server.address()).unwrap();
            stream.write_all(&bytes).unwrap();
            std::thread::sleep(Duration::from_millis(5));
            // Unread bytes or not: the peer hears a reset.
            reset(&stream);
        }
        // Each of them would take a second or more on one thread.
        let small = Request::from(once(&cube(27), "dense-cholesky"));
        let start = std::time::Instant::now();
        answer(&mut client(&server), &small);
        println!("answered {:.1} s after the last reset", start.elapsed().as_secs_f64());
    });
}

/// Closes a connection with a reset, as when a process is killed with unread bytes.
fn reset(stream: &TcpStream) {
    let socket = socket2::SockRef::from(stream);
    socket.set_linger(Some(Duration::ZERO)).unwrap();
}
