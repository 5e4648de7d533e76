//! A stop with a time to drain, and the status pages meanwhile.

use std::io::{Read, Write};
use std::net::{SocketAddr, TcpStream};
use std::time::{Duration, Instant};

use fea_server::ServerConfig;
use glove_client::ask::connection::{LinkError, ServerConnection};
use softgrasp_protocol::{RejectCode, Reply, Request};
use softgrasp_tests::questions::{cube, frame, upload};
use softgrasp_tests::watchdog::{until, within};

use crate::start::{answer, client, config};

const LIMIT: Duration = Duration::from_secs(60);

/// Status line and text of a page.
fn page(address: SocketAddr, path: &str) -> (String, String) {
    let mut stream = TcpStream::connect(address).unwrap();
    write!(stream, "GET {path} HTTP/1.1\r\nHost: here\r\n\r\n").unwrap();
    let mut answer = String::new();
    stream.read_to_string(&mut answer).unwrap();
    let (head, text) = answer.split_once("\r\n\r\n").unwrap();
    (head.lines().next().unwrap().to_owned(), text.to_owned())
}

fn server(drain: Duration) -> fea_server::RunningServer {
    let metrics = Some(SocketAddr::from(([127, 0, 0, 1], 0)));
    fea_server::start(ServerConfig { metrics, drain, ..config(1) }).unwrap()
}

#[test]
fn draining_server_takes_nobody_and_serves_who_is_there_until_its_time_is_over() {
    within(LIMIT, "a drain", || {
        let drain = Duration::from_secs(3);
        let server = server(drain);
        let (address, pages) = (server.address(), server.metrics().unwrap());
        let mesh = cube(27);
        let mut there = client(&server);
        there.ask(&Request::UploadModel(upload(&mesh))).unwrap();
        assert_eq!(page(pages, "/ready").0, "HTTP/1.1 200 OK");
        let begun = Instant::now();
        let stopping = std::thread::spawn(move || server.stop());
        until(LIMIT, "draining", || page(pages, "/ready").0.contains("503"));
        assert_eq!(page(pages, "/ready").1, "stopping\n");
        assert_eq!(page(pages, "/health").0, "HTTP/1.1 200 OK");
        let refused = ServerConnection::connect(address.to_string()).err().unwrap();
        assert!(matches!(refused, LinkError::Connect { .. }), "{refused}");
        // Who is there goes on, until it is told to go.
        answer(&mut there, &Request::from(frame(&mesh, 1.0, "sparse-cholesky")));
        let told = loop {
            match there.ask(&Request::Ping { nonce: 1 }) {
                Ok(Reply::Pong { .. }) => std::thread::sleep(Duration::from_millis(20)),
                other => break other,
            }
        };
        assert!(begun.elapsed() >= drain, "told to go before its time was over");
        match told {
            Err(LinkError::Rejected(rejected)) => {
                assert_eq!(rejected.code, RejectCode::ShuttingDown);
            }
            Err(LinkError::Closed | LinkError::Connection(_)) => {}
            other => panic!("{other:?}"),
        }
        stopping.join().unwrap();
    });
}

#[test]
fn drain_ends_with_the_last_session() {
    within(LIMIT, "a drain that nobody uses", || {
        let server = server(Duration::from_secs(3600));
        let pages = server.metrics().unwrap();
        let there = client(&server);
        let stopping = std::thread::spawn(move || server.stop());
        until(LIMIT, "draining", || page(pages, "/ready").0.contains("503"));
        drop(there);
        stopping.join().unwrap();
    });
}

#[test]
fn requests_are_counted_by_kind_and_refusals_by_code() {
    let server = server(Duration::ZERO);
    let pages = server.metrics().unwrap();
    let mesh = cube(27);
    let mut connection = client(&server);
    connection.ask(&Request::UploadModel(upload(&mesh))).unwrap();
    for _ in 0..3 {
        answer(&mut connection, &Request::from(frame(&mesh, 1.0, "sparse-cholesky")));
    }
    connection.ask(&Request::from(frame(&cube(64), 1.0, "sparse-cholesky"))).unwrap_err();
    let (status, text) = page(pages, "/metrics");
    assert_eq!(status, "HTTP/1.1 200 OK");
    for line in [
        "softgrasp_request_seconds_count{kind=\"UploadModel\"} 1",
        "softgrasp_request_seconds_count{kind=\"Frame\"} 4",
        "softgrasp_refused_total{code=\"UnknownModel\"} 1",
        "softgrasp_sessions 1",
        "softgrasp_models 1",
    ] {
        assert!(text.lines().any(|found| found == line), "{line} is missing in:\n{text}");
    }
}
