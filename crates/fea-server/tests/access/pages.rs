//! The pages about the server's state are there for everybody, whoever else is connected to them.

use std::io::{Read, Write};
use std::net::TcpStream;
use std::time::Duration;

use crate::running::{LONG, Running};

#[test]
fn pages_answer_while_silent_and_slow_connections_are_held_open() {
    let server = Running::start(&[]);
    let mut held = Vec::new();
    for count in [16, 40, 100, 500] {
        while held.len() < count {
            let mut stream = TcpStream::connect(server.pages).unwrap();
            // Every second one has begun to ask.
            if held.len() % 2 == 0 {
                stream.write_all(b"GET /health HTTP/1.1\r\n").unwrap();
            }
            held.push(stream);
        }
        // The newest one that is held is there still when all pages have been answered: so they were
        // not answered because its time was over.
        for path in ["/health", "/ready", "/metrics"] {
            assert_eq!(server.page(path).0, 200, "{path} beside {count}");
        }
        let newest = held.last_mut().unwrap();
        newest.set_read_timeout(Some(Duration::from_millis(1))).unwrap();
        let error = newest.read(&mut [0]).unwrap_err();
        assert!(
            matches!(error.kind(), std::io::ErrorKind::WouldBlock | std::io::ErrorKind::TimedOut),
            "{error} beside {count}"
        );
    }
    // The oldest had to go.
    let oldest = held.first_mut().unwrap();
    oldest.set_read_timeout(Some(LONG)).unwrap();
    assert!(!matches!(oldest.read(&mut [0]), Ok(1..)), "it has no page");
}
