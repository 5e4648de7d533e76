//! Bytes that are not frames, and frames with wrong sizes: only their session is refused.

use std::net::SocketAddr;
use std::time::{Duration, Instant};

use fea_server::{ServerConfig, Tokens};
use glove_client::ask::connection::{LinkError, ServerConnection};
use glove_client::ask::endpoint::Endpoint;
use softgrasp_protocol::{Kind, Masks, Prefetch, RejectCode, Reply, Request, VERSION};
use softgrasp_tests::heard::{AnswerBits, Heard};
use softgrasp_tests::questions::{cube, frame, once, upload};
use softgrasp_tests::random::Random;
use softgrasp_tests::raw_session::{RawSession, raw_frame, raw_header, request_frame};
use softgrasp_tests::watchdog::{until, within};

use crate::start::{answer, client, config, server};

const LIMIT: Duration = Duration::from_secs(120);
/// Longest time of a stop: the grace time, and some more for a busy machine.
const STOP_MAX: Duration = Duration::from_secs(10);

/// Another session that must not be affected.
struct Bystander {
    connection: ServerConnection,
    request: Request,
    expected: Heard,
}

impl Bystander {
    fn new(server: &fea_server::RunningServer) -> Self {
        let mesh = cube(64);
        let mut connection = client(server);
        connection.ask(&Request::UploadModel(upload(&mesh))).unwrap();
        let request = Request::from(frame(&mesh, 1.0, "sparse-cholesky"));
        let expected = Heard::Answer(AnswerBits::of(&answer(&mut connection, &request)));
        Self { connection, request, expected }
    }

    fn look(&mut self) {
        let heard = Heard::of(&self.connection.ask(&self.request).unwrap());
        assert_eq!(heard, self.expected, "another session is disturbed");
    }
}

fn hello(token: Option<&str>) -> Request {
    let token = token.map(str::to_owned);
    Request::Hello(softgrasp_protocol::Hello::new("a test", token))
}

fn ping(nonce: u64) -> Request {
    Request::Ping { nonce }
}

/// Code and text of a refusal.
fn rejected(reply: Reply) -> (RejectCode, String) {
    match reply {
        Reply::Rejected(rejected) => (rejected.code, rejected.text),
        other => panic!("not refused: {other:?}"),
    }
}

/// Sends bytes that are no frames; returns the refusal with id 0, if one comes before the end.
fn last_words(address: SocketAddr, bytes: &[u8]) -> Option<(RejectCode, String)> {
    let mut session = RawSession::open(address);
    session.send(bytes);
    session.finish();
    let (id, reply) = session.reply()?;
    assert_eq!(id, 0, "{reply:?}");
    assert!(session.reply().is_none(), "the session ends");
    Some(rejected(reply))
}

#[test]
fn every_flipped_bit_closes_its_session_and_no_other() {
    within(LIMIT, "flipped bits", || {
        let server = server(1);
        let mut bystander = Bystander::new(&server);
        let sound = request_frame(9, &ping(1));
        for bit in 0..8 * sound.len() {
            let mut bytes = sound.clone();
            bytes[bit / 8] ^= 1 << (bit % 8);
            let (code, text) = last_words(server.address(), &bytes).expect("last words");
            match code {
                RejectCode::BadRequest | RejectCode::UnsupportedVersion => {}
                _ => panic!("bit {bit}: {code} {text}"),
            }
            if bit % 32 == 0 {
                bystander.look();
            }
        }
        bystander.look();
    });
}

#[test]
fn truncated_frames_and_garbage_close_their_session_and_no_other() {
    within(LIMIT, "garbage", || {
        let mut random = Random::from_environment("garbage");
        let server = server(1);
        let mut bystander = Bystander::new(&server);
        let sound = request_frame(3, &Request::from(once(&cube(27), "auto")));
        for round in 0..150 {
            let mut bytes = match round % 3 {
                0 => Vec::new(),
                1 => sound[..1 + random.below(sound.len() - 1)].to_vec(),
                _ => b"SGRP".to_vec(),
            };
            if round % 3 != 1 {
                let len = 1 + random.below(3000);
                bytes.extend(random.bytes(len));
            }
            if let Some((code, text)) = last_words(server.address(), &bytes) {
                let expected =
                    [RejectCode::BadRequest, RejectCode::UnsupportedVersion, RejectCode::TooLarge];
                assert!(expected.contains(&code), "round {round}: {code} {text}");
            }
            if round % 10 == 0 {
                bystander.look();
            }
        }
        let (code, _) = last_words(server.address(), b"GET / HTTP/1.1\r\n\r\n").unwrap();
        assert_eq!(code, RejectCode::BadRequest);
        bystander.look();
    });
}

#[test]
fn oversized_payload_is_refused_at_its_header() {
    let server = server(1);
    let mut session = RawSession::open(server.address());
    session.send(&raw_header(VERSION, Kind::UploadModel.number(), 5, u32::MAX, &[]));
    let (id, reply) = session.reply().expect("an answer before any payload");
    let (code, text) = rejected(reply);
    assert_eq!((id, code), (0, RejectCode::TooLarge));
    assert!(text.contains("4294967295") && text.contains("limit"), "{text}");
    assert!(session.reply().is_none());
}

#[test]
fn reason_reaches_a_client_that_is_still_sending_when_it_is_refused() {
    within(LIMIT, "a refused upload", || {
        let server = server(1);
        for _ in 0..20 {
            let mut session = RawSession::open(server.address());
            session.send(&raw_header(VERSION, Kind::UploadModel.number(), 5, u32::MAX, &[]));
            // Far more than the socket's buffers hold.
            session.send(&vec![0; 8 << 20]);
            session.finish();
            let (_, reply) = session.reply().expect("the reason");
            assert_eq!(rejected(reply).0, RejectCode::TooLarge);
        }
    });
}

#[test]
fn another_protocol_version_is_told_which_one_is_spoken() {
    let server = server(1);
    for version in [0, VERSION + 1, u16::MAX] {
        let header = raw_header(version, Kind::Hello.number(), 1, 0, &[]);
        let (code, text) = last_words(server.address(), &header).expect("last words");
        assert_eq!(code, RejectCode::UnsupportedVersion);
        let spoken = format!("speaks {VERSION}");
        assert!(text.contains(&version.to_string()) && text.contains(&spoken), "{text}");
    }
}

#[test]
fn sound_frames_without_a_sound_message_are_refused_and_the_session_lives() {
    let server = server(1);
    let mut session = RawSession::open(server.address());
    let mut id = 0;
    let mut expect = |session: &mut RawSession, kind: u16, payload: &[u8], says: &str| {
        id += 1;
        session.send(&raw_frame(kind, id, payload));
        let (replied, reply) = session.reply().expect("the session lives");
        let (code, text) = rejected(reply);
        assert_eq!((replied, code), (id, RejectCode::BadRequest), "kind {kind:#06x}: {text}");
        assert!(text.contains(says), "kind {kind:#06x}: {text}");
        let pong = session.ask(1000 + id, &ping(id));
        assert_eq!(pong, Reply::Pong { nonce: id });
    };
    for kind in [0x0000, 0x000d, 0x7fff, 0xffff] {
        expect(&mut session, kind, &[], "unknown message kind");
    }
    for kind in Kind::ALL.into_iter().filter(|kind| kind.is_reply()) {
        expect(&mut session, kind.number(), &[], "other direction");
    }
    let has_reply =
        [Kind::Hello, Kind::Ask, Kind::HaveModel, Kind::UploadModel, Kind::ContactFrame];
    for kind in has_reply {
        expect(&mut session, kind.number(), &[], "the length of the part");
        expect(&mut session, kind.number(), &[0xff; 64], "");
    }
    expect(&mut session, Kind::Ping.number(), &[0; 16], "left over");
}

#[test]
fn hostile_counts_under_sound_checksums_are_refused() {
    let server = server(1);
    let mut session = RawSession::open(server.address());
    let sound = request_frame(1, &Request::from(once(&cube(27), "auto")));
    let payload = &sound[softgrasp_protocol::HEADER_LEN..];
    // node_count, tet_count and material_count stand behind the length of the part and the number of
    // the subject (docs/wire.md).
    for (at, count, code) in [
        (0, u32::MAX, RejectCode::TooLarge),
        (0, 400_000, RejectCode::BadRequest),
        (4, u32::MAX, RejectCode::TooLarge),
        (4, 2_400_000, RejectCode::BadRequest),
        (9, u32::MAX, RejectCode::TooLarge),
        (9, 65_536, RejectCode::BadRequest),
    ] {
        let mut payload = payload.to_vec();
        let at = 8 + 4 + at;
        payload[at..at + 4].copy_from_slice(&count.to_le_bytes());
        session.send(&raw_frame(Kind::Ask.number(), 2, &payload));
        let (id, reply) = session.reply().expect("the session lives");
        let (found, text) = rejected(reply);
        assert_eq!((id, found), (2, code), "{text}");
        let says = if code == RejectCode::TooLarge { "limit" } else { "there" };
        assert!(text.contains(says), "{text}");
    }
    assert!(matches!(session.ask(3, &Request::from(once(&cube(27), "auto"))), Reply::Answer(_)));
}

#[test]
fn broken_hints_are_not_answered_because_hints_have_no_reply() {
    let server = server(1);
    let mut session = RawSession::open(server.address());
    for kind in [Kind::Prefetch, Kind::Drop] {
        session.send(&raw_frame(kind.number(), 5, &[]));
        session.send(&raw_frame(kind.number(), 6, &[0xff; 40]));
    }
    let unknown = Prefetch {
        model: softgrasp_protocol::ModelHash([3; 32]),
        nodes: vec![9],
        masks: Masks::default(),
    };
    session.send(&request_frame(7, &Request::Prefetch(unknown)));
    assert_eq!(session.ask(8, &ping(4)), Reply::Pong { nonce: 4 });
}

#[test]
fn requests_before_the_right_token_are_refused_and_the_token_opens_the_session() {
    let tokens = Some(Tokens::of("open sesame"));
    let server = fea_server::start(ServerConfig { tokens, ..config(1) }).unwrap();
    let mut session = RawSession::open(server.address());
    let refuse = |session: &mut RawSession, id, request: &Request| {
        let (code, text) = rejected(session.ask(id, request));
        assert_eq!(code, RejectCode::NotAuthorised);
        assert!(text.contains("token") && text.contains("Hello"), "{text}");
    };
    refuse(&mut session, 1, &ping(1));
    refuse(&mut session, 2, &Request::UploadModel(upload(&cube(27))));
    refuse(&mut session, 3, &hello(None));
    refuse(&mut session, 4, &hello(Some("open barley")));
    refuse(&mut session, 5, &hello(Some("")));
    refuse(&mut session, 6, &ping(2));
    assert!(matches!(session.ask(7, &hello(Some("open sesame"))), Reply::Welcome(_)));
    assert_eq!(session.ask(8, &ping(3)), Reply::Pong { nonce: 3 });
    // The next session starts without.
    refuse(&mut RawSession::open(server.address()), 1, &ping(1));
    let address = server.address().to_string();
    assert!(
        ServerConnection::connect(Endpoint::from(&address).with_token(Some("open sesame"))).is_ok()
    );
    let wrong = ServerConnection::connect(Endpoint::from(&address).with_token(Some("wrong"))).err();
    assert!(matches!(wrong, Some(LinkError::Rejected(r)) if r.code == RejectCode::NotAuthorised));
}

#[test]
fn one_session_too_many_is_told_busy_and_a_place_that_is_left_is_given_again() {
    within(LIMIT, "too many sessions", || {
        let server = fea_server::start(ServerConfig { max_sessions: 2, ..config(1) }).unwrap();
        let address = server.address().to_string();
        let first = client(&server);
        let mut second = client(&server);
        for _ in 0..20 {
            let error = ServerConnection::connect(&address).err();
            let Some(LinkError::Rejected(rejected)) = error else { panic!("{error:?}") };
            assert_eq!(rejected.code, RejectCode::Busy);
            assert!(rejected.text.contains("--max-sessions"), "{}", rejected.text);
        }
        assert_eq!(second.ask(&ping(5)).unwrap(), Reply::Pong { nonce: 5 });
        drop(first);
        until(LIMIT, "a free place", || ServerConnection::connect(&address).is_ok());
    });
}

#[test]
fn client_that_stops_inside_a_frame_is_given_up_and_an_idle_one_is_not() {
    within(LIMIT, "a stalled client", || {
        let stall_limit = Duration::from_millis(100);
        let server = fea_server::start(ServerConfig { stall_limit, ..config(1) }).unwrap();
        let mut idle = client(&server);
        let bytes = request_frame(1, &ping(1));
        for sent in [1, 31, 32, bytes.len() - 1] {
            let start = Instant::now();
            let mut stalled = RawSession::open(server.address());
            stalled.send(&bytes[..sent]);
            assert!(stalled.reply().is_none(), "given up without an answer");
            assert!(start.elapsed() >= stall_limit, "not before its time");
        }
        // Longer than the limit between two frames is nobody's fault.
        assert_eq!(idle.ask(&ping(2)).unwrap(), Reply::Pong { nonce: 2 });
    });
}

#[test]
fn client_that_takes_no_reply_delays_no_other_and_no_stop() {
    within(LIMIT, "a client that does not read", || {
        let server = server(1);
        let mut bystander = Bystander::new(&server);
        let mut deaf = RawSession::open(server.address());
        let mesh = cube(1000);
        assert!(matches!(deaf.ask(1, &Request::UploadModel(upload(&mesh))), Reply::ModelReady(_)));
        // Replies that are not read fill the buffers on the way; then no request is read any more.
        deaf.send_until_full(&request_frame(2, &Request::from(frame(&mesh, 1.0, "auto"))));
        for _ in 0..50 {
            bystander.look();
        }
        drop(bystander);
        let start = Instant::now();
        server.stop();
        assert!(start.elapsed() < STOP_MAX, "the stop took {:?}", start.elapsed());
    });
}
