//! A server that stops while clients ask: they end cleanly and in time.

use std::sync::mpsc::channel;
use std::time::{Duration, Instant};

use glove_client::ask::connection::{LinkError, ServerConnection};
use softgrasp_protocol::{RejectCode, Reply, Request};
use softgrasp_tests::heard::AnswerBits;
use softgrasp_tests::questions::{cube, frame, once, upload};
use softgrasp_tests::watchdog::within;

use crate::start::{answer, client, server};

const LIMIT: Duration = Duration::from_secs(120);
/// Longest time of a stop: the grace time, and some more for a busy machine.
const STOP_MAX: Duration = Duration::from_secs(10);

/// Whether the error of a client that was cut off says so.
fn is_clean(error: &LinkError) -> bool {
    match error {
        LinkError::Closed | LinkError::Connection(_) => true,
        LinkError::Rejected(rejected) => rejected.code == RejectCode::ShuttingDown,
        _ => false,
    }
}

#[test]
fn clients_that_keep_asking_end_cleanly_when_the_server_stops() {
    within(LIMIT, "a stop under load", || {
        let server = server(2);
        let mesh = cube(125);
        let mut connection = client(&server);
        connection.ask(&Request::UploadModel(upload(&mesh))).unwrap();
        let request = Request::from(frame(&mesh, 1.0, "sparse-cholesky"));
        let expected = AnswerBits::of(&answer(&mut connection, &request));
        let (asked, is_asked) = channel();
        let clients: Vec<_> = (0..4)
            .map(|_| {
                let mut connection = client(&server);
                let (request, expected, asked) = (request.clone(), expected.clone(), asked.clone());
                std::thread::spawn(move || {
                    loop {
                        match connection.ask(&request) {
                            Ok(Reply::Answer(found)) => {
                                assert_eq!(AnswerBits::of(&found), expected);
                                let _ = asked.send(());
                            }
                            Ok(other) => panic!("{other:?}"),
                            Err(error) => return error,
                        }
                    }
                })
            })
            .collect();
        (0..40).for_each(|_| is_asked.recv().unwrap());
        let start = Instant::now();
        server.stop();
        assert!(start.elapsed() < STOP_MAX, "the stop took {:?}", start.elapsed());
        for client in clients {
            let error = client.join().unwrap();
            assert!(is_clean(&error), "{error}");
        }
    });
}

#[test]
fn idle_client_hears_that_the_server_stops() {
    within(LIMIT, "a stop with an idle client", || {
        let server = server(1);
        let mut idle = client(&server);
        let address = server.address();
        server.stop();
        let error = idle.ask(&Request::Ping { nonce: 1 }).unwrap_err();
        assert!(is_clean(&error), "{error}");
        let error = ServerConnection::connect(address.to_string()).err().unwrap();
        assert!(matches!(error, LinkError::Connect { .. }), "{error}");
        assert!(error.to_string().contains("fea-server --listen"), "{error}");
    });
}

#[test]
fn stop_does_not_wait_for_long_work_beyond_its_grace_time() {
    within(LIMIT, "a stop during long work", || {
        let server = server(1);
        let mut connection = client(&server);
        // Longer on one thread than the grace time, on a fast machine too.
        let long = Request::from(once(&cube(1000), "gauss-jordan-plain"));
        connection.send(&long).unwrap();
        // By the time this one is answered the long one has been read.
        assert!(matches!(client(&server).ask(&Request::Ping { nonce: 2 }), Ok(Reply::Pong { .. })));
        let stopping = std::thread::spawn(move || {
            let start = Instant::now();
            server.stop();
            start.elapsed()
        });
        let error = connection.ask(&Request::Ping { nonce: 1 }).unwrap_err();
        assert!(is_clean(&error), "{error}");
        let took = stopping.join().unwrap();
        assert!(took < STOP_MAX, "the stop took {took:?}");
    });
}
