//! A story that a person watches waits until the server has prepared the object, however long that takes.

use std::net::{SocketAddr, TcpListener, TcpStream};
use std::sync::mpsc::{Receiver, channel};
use std::time::Duration;

use glove_client::ask::link::Link;
use glove_client::pace::tick_budget::Priority;
use glove_client::pace::{Due, Pace};
use glove_client::run::grasp_loop::GraspLoop;
use glove_client::run::run_report::RunReport;
use glove_client::run::session::Session;
use nalgebra::Isometry3;
use softgrasp_grasp::grasp::{Grasp, StateName};
use softgrasp_grasp::object::SoftObject;
use softgrasp_hand::hand_reader::HandReader;
use softgrasp_hand::hand_setup::HandSetup;
use softgrasp_hand::scripted::{ScriptName, ScriptedHand};
use softgrasp_protocol::blocking::Connection;
use softgrasp_protocol::{Limits, ModelHash, ModelReady, Reply, Request, StageMs, Welcome};
use softgrasp_tests::questions::cube;
use softgrasp_tests::watchdog::until;

use crate::controlled::summary;
use crate::settings::linear_settings;

/// Time after which a test gives up waiting.
const PATIENCE: Duration = Duration::from_secs(60);

/// Server that has prepared the model when it is told so, and answers nothing else.
fn slow_server(is_prepared: Receiver<()>) -> SocketAddr {
    let listener = TcpListener::bind(("127.0.0.1", 0)).unwrap();
    let address = listener.local_addr().unwrap();
    std::thread::spawn(move || serve(listener.accept().unwrap().0, &is_prepared));
    address
}

fn serve(stream: TcpStream, is_prepared: &Receiver<()>) {
    let limits = Limits::default();
    let mut connection = Connection::new(stream, limits);
    let mut out = Vec::new();
    while let Ok(Some(frame)) = connection.read_frame() {
        let reply = match Request::decode(&frame, &limits).unwrap() {
            Request::Hello(_) => Reply::Welcome(Welcome {
                server: "slow".to_owned(),
                version: "0".to_owned(),
                threads: 1,
                ..Welcome::default()
            }),
            Request::HaveModel(_) => Reply::ModelState { known: false },
            Request::UploadModel(model) => {
                is_prepared.recv().unwrap();
                Reply::ModelReady(ModelReady {
                    model: ModelHash::of(&model),
                    unknown_dofs: 0,
                    fixed_dofs: 0,
                    reused: false,
                    stage_ms: StageMs::default(),
                })
            }
            _ => continue,
        };
        out.clear();
        reply.encode_into(frame.request_id(), &limits, &mut out).unwrap();
        if connection.write_bytes(&out).is_err() {
            return;
        }
    }
}

fn session(address: SocketAddr) -> Session {
    let object = SoftObject::try_new(cube(64)).unwrap();
    let setup = HandSetup::default();
    let hand = ScriptedHand::try_new(ScriptName::Squeeze, setup.clone(), &object).unwrap();
    let settings = linear_settings();
    let (hand_name, server) = ("scripted:squeeze".to_owned(), address.to_string());
    let report = RunReport::new(summary(&object), hand_name, server, Pace::Free, settings.contact);
    let grasp = Grasp::try_new(Isometry3::identity(), Grasp::RELEASE_MARGIN_M).unwrap();
    let link = Link::start(address.to_string(), Priority::Ordinary).unwrap();
    let reader = HandReader::new(setup);
    let grasp_loop = GraspLoop::try_new(reader, object, grasp, link, settings, Pace::Free).unwrap();
    Session::new(grasp_loop, hand, report, Priority::Ordinary, false)
}

/// With 60 000 nodes the whole story was played, and ended, while the server was still preparing them.
#[test]
fn story_is_not_mimed_while_the_server_prepares_the_object() {
    let (prepared, is_prepared) = channel();
    let mut session = session(slow_server(is_prepared));
    // Dropped before the session, which waits for what the server is at.
    let prepared = prepared;
    session.await_model();
    let mut tick = 0;
    let mut play = || {
        let due = Due { tick, skipped: 0 };
        let outcome = session.play(due, tick as f64 / 60.0).unwrap().unwrap();
        tick += 1;
        let palm = session.grasp_loop().hand().unwrap().world_from_palm;
        let state = outcome.state.unwrap();
        let is_held = matches!(state, StateName::Attached | StateName::Deforming);
        (is_held, palm, session.grasp_loop().is_model_prepared())
    };
    let (_, waiting_at, _) = play();
    // From before it is connected on, and then twice as long as the story takes.
    until(PATIENCE, "the server to be at work", || {
        let (is_held, palm, is_prepared) = play();
        assert!(!is_held && palm == waiting_at, "{is_held} {palm} {waiting_at}");
        !is_prepared
    });
    for _ in 0..1000 {
        let (is_held, palm, is_prepared) = play();
        assert!(!is_held && palm == waiting_at && !is_prepared, "{is_held} {palm} {waiting_at}");
    }
    prepared.send(()).unwrap();
    until(PATIENCE, "the hand to take hold", || play().0);
}
