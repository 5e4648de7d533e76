//! Connections that send nothing keep no client out and take no session's place.

use std::net::{IpAddr, SocketAddr, TcpStream};

use softgrasp_protocol::{Hello, Limits, RejectCode, Request};

use crate::running::{Client, Running};

/// A connection from one of this machine's addresses; `None` where it has only one.
fn from(own: [u8; 4], to: SocketAddr) -> Option<TcpStream> {
    let socket = socket2::Socket::new(socket2::Domain::IPV4, socket2::Type::STREAM, None).unwrap();
    socket.bind(&SocketAddr::new(IpAddr::from(own), 0).into()).ok()?;
    socket.connect(&to.into()).unwrap();
    Some(socket.into())
}

/// Whether a new client is served while these connections are open, and `/ready` says so.
fn newcomer_is_served(server: &Running, held: &[TcpStream]) {
    assert_eq!(server.page("/ready"), (200, "ready\n".to_owned()), "beside {}", held.len());
    assert_eq!(server.client().hello("a newcomer", None), Ok(()), "beside {}", held.len());
    assert!(server.client().is_served(), "without a greeting, beside {}", held.len());
}

#[test]
fn silent_connections_keep_no_newcomer_out_and_the_server_stays_ready() {
    let server = Running::start(&[]);
    // At once, and then in two steps up to more than there is room for.
    let mut held = Vec::new();
    for count in [64, 65, 200, 700] {
        while held.len() < count {
            let own = [127, 0, 0, 1 + (held.len() % 2) as u8];
            held.push(from(own, server.address).unwrap_or_else(|| server.silent()));
        }
        newcomer_is_served(&server, &held);
    }
    assert!(server.metric("softgrasp_strangers") <= 256.0);
    // Some of the 700 had to go, and were no session.
    assert!(server.metric("softgrasp_not_introduced_total") >= 400.0);
    assert_eq!(server.metric("softgrasp_given_up_total"), 0.0);
}

#[test]
fn half_a_header_is_no_introduction_and_takes_no_place() {
    let server = Running::start(&["--max-sessions", "2"]);
    let mut bytes = Vec::new();
    let ping = Request::Ping { nonce: 1 };
    ping.encode_into(1, &Limits::default(), &mut bytes).unwrap();
    let mut held = Vec::new();
    for cut in [1, 31, 32, bytes.len() - 1] {
        for _ in 0..20 {
            let mut client = server.client();
            client.send(&bytes[..cut]);
            held.push(client);
        }
    }
    let mut first = server.client();
    assert!(first.is_served());
    assert_eq!(server.metric("softgrasp_sessions"), 1.0);
    assert_eq!(server.page("/ready").0, 200);
    // Those who go on are let in as long as there is a place.
    assert!(held.pop().is_some_and(|mut client| {
        client.send(&bytes[bytes.len() - 1..]);
        client.reply().is_some()
    }));
}

#[test]
fn client_that_introduces_itself_without_a_place_is_told_busy_and_a_guess_takes_none() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("token");
    std::fs::write(&file, "a token that is long enough\n").unwrap();
    let server = Running::start(&["--max-sessions", "1", "--token-file", file.to_str().unwrap()]);
    let right = Some("a token that is long enough");
    // Guesses and silence take no place.
    let mut guesses = server.client();
    assert_eq!(guesses.hello("a guesser", Some("guess")), Err(RejectCode::NotAuthorised));
    let _silent = server.silent();
    assert_eq!(server.metric("softgrasp_sessions"), 0.0);
    let mut first = server.client();
    assert_eq!(first.hello("first", right), Ok(()));
    assert_eq!(server.page("/ready").0, 503);
    let mut second = server.client();
    assert_eq!(second.hello("second", right), Err(RejectCode::Busy));
    assert!(second.reply().is_none(), "it is closed");
    assert_eq!(server.metric("softgrasp_turned_away_total"), 1.0);
    assert!(first.is_served());
    drop(first);
    server.await_metric("softgrasp_sessions", 0.0);
    assert_eq!(server.client().hello("third", right), Ok(()));
}

#[test]
fn stranger_is_closed_when_its_time_is_over_however_it_spends_it() {
    let server = Running::start(&["--greeting-limit", "0.3", "--stall-limit", "30"]);
    let mut bytes = Vec::new();
    let hello = Hello::new("late", None);
    Request::Hello(hello).encode_into(1, &Limits::default(), &mut bytes).unwrap();
    for cut in [0, 1, 32, bytes.len() - 1] {
        let mut client = server.client();
        client.send(&bytes[..cut]);
        assert!(client.reply().is_none(), "closed after {cut} bytes");
    }
    assert_eq!(server.metric("softgrasp_not_introduced_total"), 4.0);
    // Who is known may rest.
    let mut known = server.client();
    assert!(known.is_served());
    let mut silent = Client::over(server.silent());
    assert!(silent.reply().is_none(), "closed");
    assert!(known.is_served());
}
