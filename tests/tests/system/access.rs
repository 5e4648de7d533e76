//! Access: tokens, encryption, connections that have not introduced themselves.

use std::net::SocketAddr;
use std::path::PathBuf;
use std::time::{Duration, Instant};

use fea_server::{
    ConfigError, Encryption, RunningServer, ServerConfig, StartError, Tokens, make_certificate,
};
use glove_client::ask::connection::{LinkError, ServerConnection};
use glove_client::ask::endpoint::{Endpoint, Trust};
use softgrasp_protocol::{RejectCode, Reply, Request, VERSION};
use softgrasp_tests::heard::Heard;
use softgrasp_tests::questions::{cube, frame, once, upload};
use softgrasp_tests::raw_session::{RawSession, raw_header};
use softgrasp_tests::watchdog::within;

use crate::start::config;

const LIMIT: Duration = Duration::from_secs(60);

/// Certificate and key of this machine, in a folder that is removed with this value.
struct Pair {
    certificate: PathBuf,
    key: PathBuf,
    _folder: tempfile::TempDir,
}

impl Pair {
    fn of_this_machine() -> Self {
        let folder = tempfile::tempdir().unwrap();
        let (certificate, key) = (folder.path().join("certificate"), folder.path().join("key"));
        let names = ["localhost", "127.0.0.1"].map(str::to_owned);
        make_certificate(&names, 1, &certificate, &key).unwrap();
        Self { certificate, key, _folder: folder }
    }

    fn server(&self) -> RunningServer {
        let encryption = Some(Encryption::read(&self.certificate, &self.key).unwrap());
        let tokens = Some(Tokens::of("open sesame"));
        fea_server::start(ServerConfig { encryption, tokens, ..config(2) }).unwrap()
    }

    fn endpoint(&self, server: &RunningServer) -> Endpoint {
        let trust = Some(Trust::read(&self.certificate).unwrap());
        let endpoint = Endpoint::from(server.address().to_string());
        Endpoint { trust, ..endpoint.with_token(Some("open sesame")) }
    }
}

fn rejection(to: impl Into<Endpoint>) -> (RejectCode, String) {
    match ServerConnection::connect(to).err() {
        Some(LinkError::Rejected(rejected)) => (rejected.code, rejected.text),
        other => panic!("{other:?}"),
    }
}

#[test]
fn address_that_guesses_tokens_is_barred_even_with_the_right_one() {
    within(LIMIT, "guesses", || {
        let tokens = Some(Tokens::of("open sesame"));
        let server = fea_server::start(ServerConfig { tokens, ..config(1) }).unwrap();
        let endpoint = Endpoint::from(server.address().to_string());
        let right = || endpoint.clone().with_token(Some("open sesame"));
        assert!(ServerConnection::connect(right()).is_ok());
        for guess in 0..5 {
            let guessed = endpoint.clone().with_token(Some(&format!("open {guess}")));
            let (code, text) = rejection(guessed);
            assert_eq!(code, RejectCode::NotAuthorised);
            assert!(text.contains("token"), "{text}");
        }
        let (code, text) = rejection(right());
        assert_eq!(code, RejectCode::NotAuthorised);
        assert!(text.contains("too many wrong tokens"), "{text}");
    });
}

#[test]
fn answers_over_tls_have_the_same_bits() {
    within(LIMIT, "TLS", || {
        let pair = Pair::of_this_machine();
        let (encrypted, plain) = (pair.server(), fea_server::start(config(2)).unwrap());
        let mesh = cube(216);
        let requests = [
            Request::Ping { nonce: 4 },
            Request::from(once(&mesh, "front")),
            Request::UploadModel(upload(&mesh)),
            Request::from(frame(&mesh, 0.01, "condensed")),
            Request::from(frame(&mesh, 0.02, "condensed")),
        ];
        let answers = |to: Endpoint| -> Vec<Heard> {
            let mut connection = ServerConnection::connect(to).unwrap();
            let answer = |request: &Request| {
                let reply = connection.ask_awake(request).unwrap();
                // Tickets of TLS that nobody has read are no farewell.
                assert!(!connection.is_closed());
                Heard::of(&reply)
            };
            requests.iter().map(answer).collect()
        };
        let here = answers(plain.address().to_string().into());
        assert_eq!(answers(pair.endpoint(&encrypted)), here);
    });
}

#[test]
fn encrypted_connection_that_the_server_closed_is_known_to_be_closed() {
    within(LIMIT, "a closed server", || {
        let pair = Pair::of_this_machine();
        let server = pair.server();
        let mut connection = ServerConnection::connect(pair.endpoint(&server)).unwrap();
        assert!(!connection.is_closed());
        server.stop();
        assert!(connection.is_closed());
    });
}

#[test]
fn who_is_not_trusted_or_not_encrypted_gets_an_error_and_no_answer() {
    within(LIMIT, "no trust", || {
        let (pair, other) = (Pair::of_this_machine(), Pair::of_this_machine());
        let server = pair.server();
        let good = pair.endpoint(&server);
        let stranger =
            Endpoint { trust: Some(Trust::read(&other.certificate).unwrap()), ..good.clone() };
        let error = ServerConnection::connect(&stranger).err().unwrap().to_string();
        assert!(error.contains("certificate"), "{error}");
        let unencrypted = Endpoint { trust: None, ..good.clone() };
        let error = ServerConnection::connect(&unencrypted).err().unwrap();
        assert!(matches!(error, LinkError::WantsEncryption { .. }), "{error}");
        assert!(error.to_string().contains("--tls-ca"), "{error}");
        let (code, _) = rejection(good.clone().with_token(None));
        assert_eq!(code, RejectCode::NotAuthorised);
        // Encryption towards a server that has none.
        let plain = fea_server::start(config(1)).unwrap();
        let wrong = Endpoint { address: plain.address().to_string(), ..good.clone() };
        let error = ServerConnection::connect(&wrong).err().unwrap();
        assert!(matches!(error, LinkError::Connection(_) | LinkError::Closed), "{error}");
        assert!(ServerConnection::connect(good).is_ok());
    });
}

#[test]
fn address_that_others_reach_is_not_listened_on_without_token_and_encryption() {
    let listen: SocketAddr = "0.0.0.0:0".parse().unwrap();
    let started = fea_server::start(ServerConfig { listen, ..config(1) });
    let error = started.err().unwrap();
    assert!(matches!(error, StartError::Config(ConfigError::Open { .. })), "{error}");
    let text = error.to_string();
    assert!(
        ["--token-file", "--tls-cert", "--insecure"].iter().all(|o| text.contains(o)),
        "{text}"
    );
    assert!(fea_server::start(ServerConfig { listen, is_insecure: true, ..config(1) }).is_ok());
}

#[test]
fn before_the_token_is_shown_frames_are_short_and_time_is_too() {
    within(LIMIT, "strangers", || {
        let tokens = Some(Tokens::of("open sesame"));
        let greeting_limit = Duration::from_millis(300);
        let settings = ServerConfig { tokens, greeting_limit, ..config(1) };
        let server = fea_server::start(settings).unwrap();
        let header = |payload_len| raw_header(VERSION, 1, 1, payload_len, &[]);
        let mut over = RawSession::open(server.address());
        over.send(&header(64 * 1024 + 1));
        let (_, reply) = over.reply().expect("a word why");
        assert!(matches!(reply, Reply::Rejected(r) if r.code == RejectCode::TooLarge));
        // One byte less is waited for, but not for long; so is one that says nothing at all.
        for first in [header(64 * 1024).to_vec(), Vec::new()] {
            let start = Instant::now();
            let mut session = RawSession::open(server.address());
            session.send(&first);
            assert!(session.reply().is_none(), "given up without an answer");
            assert!(start.elapsed() >= greeting_limit, "not before its time");
        }
        // Who has shown it may rest, and send long frames.
        let endpoint = Endpoint::from(server.address().to_string());
        let mut known =
            ServerConnection::connect(endpoint.with_token(Some("open sesame"))).unwrap();
        std::thread::sleep(2 * greeting_limit);
        let ready = known.ask(&Request::UploadModel(upload(&cube(8000)))).unwrap();
        assert!(matches!(ready, Reply::ModelReady(_)), "{:?}", ready.kind());
    });
}
