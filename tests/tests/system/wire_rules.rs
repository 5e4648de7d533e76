//! Rules of the wire beside answers: versions, cancelling, newest wins, `Alive`, several cases of a kept
//! model, and the sessions whose hold a `Drop` releases.

use std::io::{Read, Write};
use std::net::TcpStream;
use std::time::Duration;

use fea_server::ServerConfig;
use softgrasp_protocol::{
    Ask, Hello, ModelHash, RejectCode, Reply, ReportLevel, Request, VERSION, VersionRange,
};
use softgrasp_tests::questions::{cube, frame, once, squeeze, upload};
use softgrasp_tests::raw_session::{RawSession, raw_header, request_frame};
use softgrasp_tests::watchdog::within;

use crate::start::{answer, client, config, refusal, server};

const LIMIT: Duration = Duration::from_secs(120);

/// Request that takes long: elimination pivot by pivot.
fn long(mesh_nodes: usize) -> Request {
    Request::from(once(&cube(mesh_nodes), "gauss-jordan-plain"))
}

fn code_of(reply: Reply) -> RejectCode {
    match reply {
        Reply::Rejected(rejected) => rejected.code,
        other => panic!("no refusal: {other:?}"),
    }
}

#[test]
fn client_of_an_older_version_is_refused_in_the_form_of_its_version() {
    let server = server(1);
    for version in [1, 2, 3] {
        let mut stream = TcpStream::connect(server.address()).unwrap();
        stream.write_all(&raw_header(version, 1, 1, 0, &[])).unwrap();
        let mut bytes = Vec::new();
        stream.read_to_end(&mut bytes).unwrap();
        assert_eq!(
            (&bytes[..4], bytes[4], bytes[6], bytes[7]),
            (&b"SGRP"[..], version as u8, 5, 0x80)
        );
        let payload = &bytes[32..];
        assert_eq!(payload[..2], RejectCode::UnsupportedVersion.number().to_le_bytes());
        let len = u64::from_le_bytes(payload[2..10].try_into().unwrap()) as usize;
        let text = std::str::from_utf8(&payload[10..10 + len]).unwrap();
        assert!(text.contains(&format!("version {version}")), "{text}");
        assert!(text.contains(&format!("speaks {VERSION}")), "{text}");
    }
}

#[test]
fn highest_common_version_is_welcomed_and_none_is_refused() {
    let server = server(1);
    let mut session = RawSession::open(server.address());
    let hello = |lowest, highest| {
        let versions = VersionRange { lowest, highest };
        Request::Hello(Hello { versions, ..Hello::new("a test", None) })
    };
    match session.ask(1, &hello(2, VERSION + 7)) {
        Reply::Welcome(welcome) => {
            assert_eq!(welcome.wire, VERSION);
            assert!(welcome.capabilities.iter().any(|name| name == "cancel"));
        }
        other => panic!("{other:?}"),
    }
    let refused = session.ask(2, &hello(VERSION + 1, VERSION + 7));
    assert_eq!(code_of(refused), RejectCode::UnsupportedVersion);
}

#[test]
fn cancelled_request_gives_its_turn_to_the_next_one() {
    within(LIMIT, "a cancelled request", || {
        let server = server(1);
        let mut session = RawSession::open(server.address());
        // Seconds of work on the fastest machine; what waits behind it has room in what the server reads ahead.
        session.send(&request_frame(1, &long(1331)));
        session.send(&request_frame(2, &Request::Ping { nonce: 5 }));
        session.send(&request_frame(3, &long(512)));
        std::thread::sleep(Duration::from_millis(300));
        session.send(&request_frame(4, &Request::Cancel { request_id: 3 }));
        session.send(&request_frame(5, &Request::Cancel { request_id: 1 }));
        let (id, reply) = session.reply().expect("a refusal");
        assert_eq!((id, code_of(reply)), (1, RejectCode::Cancelled));
        assert_eq!(session.reply(), Some((2, Reply::Pong { nonce: 5 })));
        let (id, reply) = session.reply().expect("a refusal");
        assert_eq!((id, code_of(reply)), (3, RejectCode::Cancelled));
        // What is over cannot be cancelled, and nothing is said of it.
        session.send(&request_frame(6, &Request::Cancel { request_id: 2 }));
        assert_eq!(session.ask(7, &Request::Ping { nonce: 8 }), Reply::Pong { nonce: 8 });
    });
}

#[test]
fn older_frame_that_was_not_begun_is_superseded_by_the_newest() {
    within(LIMIT, "superseded frames", || {
        let server = server(1);
        let mesh = cube(64);
        let mut session = RawSession::open(server.address());
        assert!(matches!(
            session.ask(1, &Request::UploadModel(upload(&mesh))),
            Reply::ModelReady(_)
        ));
        let newest = |push| Ask { newest_wins: true, ..frame(&mesh, push, "auto") };
        // All come while the first is worked on.
        session.send(&request_frame(2, &Request::from(once(&cube(343), "gauss-jordan-plain"))));
        std::thread::sleep(Duration::from_millis(50));
        for (id, push) in [(3, 0.1), (4, 0.2), (6, 0.4)] {
            session.send(&request_frame(id, &Request::from(newest(push))));
        }
        session.send(&request_frame(7, &Request::from(frame(&mesh, 0.5, "auto"))));
        let mut heard = Vec::new();
        for _ in 0..5 {
            let (id, reply) = session.reply().expect("a reply");
            heard.push((
                id,
                match reply {
                    Reply::Answer(_) => None,
                    other => Some(code_of(other)),
                },
            ));
        }
        let superseded = Some(RejectCode::Superseded);
        assert_eq!(heard, [(2, None), (3, superseded), (4, superseded), (6, None), (7, None)]);
    });
}

#[test]
fn server_that_works_or_rests_says_that_it_is_there_to_who_wants_to_hear_it() {
    within(LIMIT, "signs of life", || {
        let server = server(1);
        let mut session = RawSession::open(server.address());
        let hello = Hello { alive_every_ms: 150, ..Hello::new("a test", None) };
        assert!(matches!(session.ask(1, &Request::Hello(hello)), Reply::Welcome(_)));
        for _ in 0..2 {
            assert_eq!(session.reply(), Some((0, Reply::Alive)), "while nothing is asked");
        }
        session.send(&request_frame(2, &long(4000)));
        for _ in 0..3 {
            assert_eq!(session.reply(), Some((0, Reply::Alive)), "while it works");
        }
        session.send(&request_frame(3, &Request::Cancel { request_id: 2 }));
        let reply = std::iter::from_fn(|| session.reply()).find(|(id, _)| *id != 0);
        let (id, reply) = reply.expect("a refusal");
        assert_eq!((id, code_of(reply)), (2, RejectCode::Cancelled));
    });
}

#[test]
fn several_cases_of_a_kept_model_are_the_answers_of_its_frames() {
    let (server, mesh) = (server(1), cube(64));
    let mut connection = client(&server);
    connection.ask(&Request::UploadModel(upload(&mesh))).unwrap();
    let pushes = [1.0, 0.5, -0.25];
    let values = |push| squeeze(&mesh, push).iter().map(|known| known.value).collect();
    for method in ["condensed", "front"] {
        let cases = pushes[1..].iter().map(|&push| values(push)).collect();
        let all = Ask { cases, ..frame(&mesh, pushes[0], method) };
        let all = answer(&mut connection, &Request::from(all));
        assert_eq!(all.cases.len(), 2);
        for (push, case) in pushes[1..].iter().zip(&all.cases) {
            let alone = answer(&mut connection, &Request::from(frame(&mesh, *push, method)));
            assert_eq!(alone.displacements.into_f64(), case.displacements, "{method} {push}");
            let reactions = alone.reactions.iter().map(|reaction| reaction.value);
            assert!(reactions.eq(case.reactions.iter().copied()), "{method} {push}");
            assert!(all.report.residual_rel >= alone.report.residual_rel);
        }
    }
    let large = Ask {
        large: Some(Default::default()),
        cases: vec![values(0.5)],
        ..frame(&mesh, 1.0, "auto")
    };
    let (code, text) = refusal(&mut connection, &Request::from(large));
    assert_eq!(code, RejectCode::BadRequest);
    assert!(text.contains("one case at a time"), "{text}");
}

#[test]
fn more_cases_of_a_kept_model_than_there_is_memory_for_are_refused() {
    let config = ServerConfig { memory_limit: 16 << 20, ..config(1) };
    let server = fea_server::start(config).unwrap();
    let mesh = cube(64);
    let mut connection = client(&server);
    connection.ask(&Request::UploadModel(upload(&mesh))).unwrap();
    let sound = frame(&mesh, 1.0, "condensed");
    let values: Vec<f64> = sound.question.known.iter().map(|known| known.value).collect();
    let many = Ask { cases: vec![values; 2000], ..sound.clone() };
    let (code, text) = refusal(&mut connection, &Request::from(many));
    assert_eq!(code, RejectCode::MemoryLimit, "{text}");
    assert!(text.contains("2001 cases"), "{text}");
    answer(&mut connection, &Request::from(sound));
}

#[test]
fn report_tells_as_much_as_was_asked_for() {
    let (server, mesh) = (server(1), cube(64));
    let mut connection = client(&server);
    connection.ask(&Request::UploadModel(upload(&mesh))).unwrap();
    let mut ask = |report| {
        let ask = Ask { report, ..frame(&mesh, 1.0, "condensed") };
        let found = answer(&mut connection, &Request::from(ask));
        (found.report, connection.bytes_of_exchange()[1])
    };
    let (full, full_bytes) = ask(ReportLevel::Full);
    assert!(full.method == "condensed" && full.residual_rel < 1e-9);
    let (short, short_bytes) = ask(ReportLevel::Short);
    assert!(short.method.is_empty() && short.residual_rel < 1e-9 && short.known_dofs > 0);
    let (none, none_bytes) = ask(ReportLevel::None);
    assert!(none.is_untold());
    assert!(none_bytes < short_bytes && short_bytes < full_bytes, "{none_bytes} {short_bytes}");
}

#[test]
fn drop_of_a_stranger_does_not_forget_the_model_that_another_client_keeps_or_has_kept() {
    let (server, mesh) = (server(1), cube(27));
    let hash = ModelHash::of(&upload(&mesh));
    let knows = |connection: &mut glove_client::ask::connection::ServerConnection| {
        matches!(connection.ask(&Request::HaveModel(hash)), Ok(Reply::ModelState { known: true }))
    };
    let mut owner = client(&server);
    owner.ask(&Request::UploadModel(upload(&mesh))).unwrap();
    drop(owner);
    let mut stranger = client(&server);
    stranger.send(&Request::Drop(hash)).unwrap();
    assert!(knows(&mut client(&server)), "the owner may come back");
    // Who holds it may forget it, if nobody else does.
    let mut owner = client(&server);
    assert!(knows(&mut owner));
    owner.send(&Request::Drop(hash)).unwrap();
    assert!(!knows(&mut owner));
}
