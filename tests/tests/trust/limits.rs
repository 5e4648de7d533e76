//! Every limit of a server: just below it, at it, and just above it.

use std::time::Duration;

use fea_server::{RunningServer, ServerConfig};
use glove_client::ask::connection::{LinkError, ServerConnection};
use softgrasp_core::mesh::TetMesh;
use softgrasp_protocol::{HEADER_LEN, Limits, ModelHash, RejectCode, Reply, Request};
use softgrasp_tests::questions::{cube, once, upload};
use softgrasp_tests::raw_session::{RawSession, request_frame};
use softgrasp_tests::watchdog::{until, within};

use crate::start::{answer, client, config, refusal};

const LIMIT: Duration = Duration::from_secs(60);

fn start(config: ServerConfig) -> RunningServer {
    fea_server::start(config).unwrap()
}

fn is_solved(server: &RunningServer, mesh: &TetMesh) -> Result<(), (RejectCode, String)> {
    let request = Request::from(once(mesh, "sparse-cholesky"));
    match client(server).ask(&request) {
        Ok(_) => Ok(()),
        Err(LinkError::Rejected(rejected)) => Err((rejected.code, rejected.text)),
        Err(other) => panic!("{other}"),
    }
}

#[test]
fn nodes_of_a_mesh() {
    let mesh = cube(27);
    for (max_nodes, fits) in [(28, true), (27, true), (26, false)] {
        let server = start(ServerConfig { max_nodes, ..config(1) });
        match is_solved(&server, &mesh) {
            Ok(()) => assert!(fits),
            Err((code, text)) => {
                assert!(!fits && code == RejectCode::TooLarge, "{max_nodes}: {text}");
            }
        }
    }
}

#[test]
fn elements_of_a_mesh() {
    let mesh = cube(27);
    let tets = mesh.tets().len() as u32;
    for (max_elements, fits) in [(tets + 1, true), (tets, true), (tets - 1, false)] {
        let server = start(ServerConfig { max_elements, ..config(1) });
        match is_solved(&server, &mesh) {
            Ok(()) => assert!(fits),
            Err((code, text)) => {
                assert!(!fits && code == RejectCode::TooLarge, "{max_elements}: {text}");
            }
        }
    }
}

#[test]
fn bytes_of_a_message() {
    let request = Request::UploadModel(upload(&cube(64)));
    let bytes = request_frame(1, &request);
    let payload = (bytes.len() - HEADER_LEN) as u32;
    for (max_frame, fits) in [(payload + 1, true), (payload, true), (payload - 1, false)] {
        let server = start(ServerConfig { max_frame, ..config(1) });
        let mut session = RawSession::open(server.address());
        session.send(&bytes);
        match session.reply() {
            Some((1, Reply::ModelReady(_))) => assert!(fits),
            Some((0, Reply::Rejected(rejected))) => {
                assert!(!fits && rejected.code == RejectCode::TooLarge, "{rejected:?}");
            }
            other => panic!("{max_frame}: {other:?}"),
        }
        // A client that knows the limit from the welcome does not even send it, and goes on.
        if !fits {
            let mut client = client(&server);
            assert_eq!(client.welcome().limits.payload_len_max, max_frame);
            assert!(matches!(client.ask(&request), Err(LinkError::Encode(_))));
            let pong = client.ask(&Request::Ping { nonce: 7 }).unwrap();
            assert_eq!(pong, Reply::Pong { nonce: 7 });
        }
    }
}

/// A mesh of more than 256 MiB is read as one message by a server that was told to; by another its client
/// does not send it.
#[test]
fn a_message_beyond_the_usual_limit_is_read_where_the_server_was_told_to() {
    let mut large = upload(&cube(27));
    large.mesh.regions.clear();
    large.mesh.tets = vec![[0, 1, 2, 3]; 17_000_000];
    // Which is refused as soon as it is looked at.
    large.mesh.tets[0] = [0, 1, 2, 27];
    let request = Request::UploadModel(large);
    let limits = Limits::LARGEST;
    let told = ServerConfig {
        max_nodes: limits.node_count_max,
        max_elements: limits.tet_count_max,
        max_frame: limits.payload_len_max,
        ..config(1)
    };
    within(5 * LIMIT, "a large message", move || {
        let server = start(told.clone());
        let (code, text) = refusal(&mut client(&server), &request);
        assert!(code == RejectCode::BadRequest && text.contains("27"), "{code}: {text}");
        let usual = start(config(1));
        assert!(matches!(client(&usual).ask(&request), Err(LinkError::Encode(_))));
        // What has no room is refused by its header; the session goes on.
        let small = start(ServerConfig { memory_limit: 256 << 20, ..told.clone() });
        let mut of_small = client(&small);
        let (code, text) = refusal(&mut of_small, &request);
        assert_eq!(code, RejectCode::MemoryLimit, "{text}");
        assert_eq!(is_solved(&small, &cube(27)), Ok(()));
    });
}

#[test]
fn sessions_at_the_same_time() {
    let server = start(ServerConfig { max_sessions: 3, ..config(1) });
    let two = [client(&server), client(&server)];
    let third = client(&server);
    let turned_away = ServerConnection::connect(server.address().to_string()).err().unwrap();
    match turned_away {
        LinkError::Rejected(rejected) => assert_eq!(rejected.code, RejectCode::Busy),
        other => panic!("{other}"),
    }
    drop(third);
    until(LIMIT, "a place", || ServerConnection::connect(server.address().to_string()).is_ok());
    drop(two);
}

#[test]
fn requests_in_the_queue_wait_and_are_all_answered() {
    within(LIMIT, "a queue of one", || {
        for max_queue in [1, 2, 3] {
            let server = start(ServerConfig { max_queue, ..config(1) });
            let mesh = cube(125);
            std::thread::scope(|scope| {
                for _ in 0..6 {
                    scope.spawn(|| {
                        let request = Request::from(once(&mesh, "dense-cholesky"));
                        answer(&mut client(&server), &request);
                    });
                }
            });
        }
    });
}

#[test]
fn memory_of_all_requests() {
    let request = Request::from(once(&cube(1000), "dense-cholesky"));
    // The text of the refusal tells what is needed; at exactly that much it is answered.
    let tiny = start(ServerConfig { memory_limit: 1 << 20, ..config(1) });
    let (code, _) = refusal(&mut client(&tiny), &request);
    assert_eq!(code, RejectCode::MemoryLimit);
    let needed = match client(&tiny).ask(&request) {
        Err(LinkError::Rejected(rejected)) => {
            let number = |name: &str| -> u64 {
                let (_, rest) = rejected.detail.split_once(name).unwrap();
                rest.split([' ', ';']).next().unwrap().parse().unwrap()
            };
            number(" model_bytes=") + number(" factor_bytes=")
        }
        other => panic!("{other:?}"),
    };
    for (memory_limit, fits) in [(needed + 1, true), (needed, true), (needed - 1, false)] {
        let server = start(ServerConfig { memory_limit, ..config(1) });
        match client(&server).ask(&request) {
            Ok(_) => assert!(fits, "{memory_limit}"),
            Err(LinkError::Rejected(rejected)) => {
                assert!(!fits && rejected.code == RejectCode::MemoryLimit, "{}", rejected.text);
            }
            Err(other) => panic!("{other}"),
        }
    }
}

#[test]
fn models_that_nobody_holds_are_kept_for_their_time() {
    within(LIMIT, "unused models", || {
        let limit = Duration::from_millis(400);
        let server = start(ServerConfig { model_idle_limit: limit, ..config(1) });
        let models = [upload(&cube(27)), upload(&cube(64))];
        let hashes = models.each_ref().map(ModelHash::of);
        let mut holder = client(&server);
        holder.ask(&Request::UploadModel(models[0].clone())).unwrap();
        let mut other = client(&server);
        other.ask(&Request::UploadModel(models[1].clone())).unwrap();
        drop(other);
        std::thread::sleep(4 * limit);
        let mut asks = client(&server);
        let is_known = |connection: &mut ServerConnection, hash| {
            matches!(
                connection.ask(&Request::HaveModel(hash)),
                Ok(Reply::ModelState { known: true })
            )
        };
        assert!(is_known(&mut asks, hashes[0]), "its session is there");
        assert!(!is_known(&mut asks, hashes[1]), "nobody has it");
    });
}

#[test]
fn client_that_rests_longer_than_allowed_is_given_up() {
    within(LIMIT, "an idle client", || {
        let idle_limit = Some(Duration::from_millis(500));
        let server = start(ServerConfig { idle_limit, ..config(1) });
        let mut session = RawSession::open(server.address());
        assert!(matches!(session.ask(1, &Request::Ping { nonce: 1 }), Reply::Pong { .. }));
        assert!(session.reply().is_none(), "it is closed");
    });
}
