//! Ticks in real time: missed ones are never replayed, long work does not delay them, and every
//! deforming tick is answered or has a reason. The test says when a tick is due; no clock decides.

use std::net::{SocketAddr, TcpListener};
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::mpsc::channel;
use std::time::Duration;

use glove_client::ask::link::Link;
use glove_client::pace::tick_budget::Priority;
use glove_client::pace::{Due, Pace};
use glove_client::run::grasp_loop::GraspLoop;
use glove_client::run::run_report::RunReport;
use glove_client::run::run_words::failure;
use glove_client::run::session::Session;
use glove_client::run::tick_outcome::TickOutcome;
use nalgebra::Isometry3;
use softgrasp_grasp::grasp::{Grasp, StateName};
use softgrasp_grasp::object::SoftObject;
use softgrasp_hand::hand_reader::HandReader;
use softgrasp_hand::hand_setup::HandSetup;
use softgrasp_hand::loaded_object::ObjectSummary;
use softgrasp_hand::scripted::{Planner, ScriptName, ScriptedHand};
use softgrasp_protocol::blocking::Connection;
use softgrasp_protocol::{Limits, RejectCode, Rejected, Reply, Request, Welcome};
use softgrasp_tests::questions::cube;

use crate::settings::linear_settings;
use crate::start::server;

/// Time after which a test gives up waiting.
const PATIENCE: Duration = Duration::from_secs(60);

/// Run in real time, played tick by tick.
struct Play {
    session: Session,
    tick: u64,
}

impl Play {
    fn new(address: &str, script: ScriptName, planner: Planner) -> Self {
        let object = SoftObject::try_new(cube(216)).unwrap();
        let setup = HandSetup::default();
        let hand = ScriptedHand::try_new(script, setup.clone(), &object).unwrap();
        let settings = linear_settings();
        let summary = ObjectSummary {
            name: "cube".to_owned(),
            nodes: 216,
            tets: object.rest().tets().len(),
            size_m: object.rest().size(),
            notes: Vec::new(),
        };
        let report = RunReport::new(
            summary,
            script.to_string(),
            address.to_owned(),
            Pace::Free,
            settings.contact,
        );
        let grasp = Grasp::try_new(Isometry3::identity(), Grasp::RELEASE_MARGIN_M).unwrap();
        let link = Link::start(address, Priority::Ordinary).unwrap();
        let reader = HandReader::new(setup);
        let grasp_loop =
            GraspLoop::try_new(reader, object, grasp, link, settings, Pace::Free).unwrap();
        let hand = hand.with_planner(planner);
        let session = Session::new(grasp_loop, hand, report, Priority::Ordinary, true);
        Self { session, tick: 0 }
    }

    /// Plays the next tick after `skipped` missed ones; `None` when the script is over.
    fn tick_after(&mut self, skipped: u64) -> Option<TickOutcome> {
        let tick = self.tick + skipped;
        self.tick = tick + 1;
        self.session.play(Due { tick, skipped }, tick as f64 / 100.0).unwrap()
    }

    /// Plays a tick that finds all finished work of server and background.
    fn settled_tick(&mut self) -> Option<TickOutcome> {
        self.session.settle(PATIENCE);
        self.tick_after(0)
    }

    fn until(&mut self, what: &str, done: impl Fn(&Session, &TickOutcome) -> bool) {
        for _ in 0..5000 {
            let outcome = self.settled_tick().expect(what);
            if done(&self.session, &outcome) {
                return;
            }
        }
        panic!("never came: {what}");
    }

    fn finish(mut self) -> RunReport {
        self.session.settle(PATIENCE);
        self.session.finish(false).unwrap()
    }
}

fn is_deforming(outcome: &TickOutcome) -> bool {
    outcome.state == Some(StateName::Deforming)
}

/// Checks the invariant of the report by its records.
fn check_counts(report: &RunReport) {
    let s = &report.summary;
    assert_eq!(report.ticks, report.played.count() + s.ticks_skipped);
    assert_eq!(s.deforming_ticks, s.solves as u64 + s.unanswered.total());
    for record in &report.played {
        let told = usize::from(record.solve.is_some()) + usize::from(record.unanswered.is_some());
        let deforms = record.state == StateName::Deforming.to_string();
        assert_eq!(told, usize::from(deforms), "tick {}: {record:?}", record.tick);
    }
}

fn json(report: &RunReport) -> serde_json::Value {
    serde_json::to_value(&report.summary).unwrap()
}

#[test]
fn slow_plan_delays_no_tick_and_the_grip_after_it_is_answered() {
    let server = server(1);
    let (gate, passed) = channel::<()>();
    // A planner that is not done before the test lets it.
    let planner = Planner::beside_by(move |request| {
        passed.recv().ok()?;
        request.plan()
    });
    let mut play = Play::new(&server.address().to_string(), ScriptName::Regrasp, planner.unwrap());
    play.until("planning", |session, _| session.hand().is_planning());
    let rest_shapes = play.session.grasp_loop().object().rest_shapes();
    assert_eq!(rest_shapes, 2, "the shape is kept before the next approach is planned");
    for _ in 0..300 {
        // The hand rests and its devices go on sending.
        let outcome = play.settled_tick().unwrap();
        assert_eq!(outcome.state, Some(StateName::Free));
        assert!(play.session.hand().is_planning());
    }
    gate.send(()).unwrap();
    // The plan takes as long as it takes; ticks that come meanwhile find the hand at rest.
    while play.session.hand().is_planning() {
        play.settled_tick().unwrap();
        std::thread::yield_now();
    }
    let second_grip_from = play.tick;
    while play.settled_tick().is_some() {}
    let report = play.finish();
    check_counts(&report);
    assert_eq!(report.summary.shapes_kept, 1);
    let answered = |record: &&glove_client::run::played_ticks::TickRecord| record.solve.is_some();
    let second: Vec<_> = report.played.iter().filter(|r| r.tick >= second_grip_from).collect();
    let deforming = second.iter().filter(|r| r.state == "Deforming").count();
    let answers = second.into_iter().filter(answered).count();
    assert!(deforming > 20 && answers == deforming, "{answers} of {deforming} answered");
    // Only while the shape is made the rest shape, nothing is asked.
    let unanswered = json(&report)["unanswered"].as_object().unwrap().clone();
    assert!(unanswered.keys().all(|why| why == "keeping_shape"), "{unanswered:?}");
}

#[test]
fn missed_ticks_are_counted_with_their_reason_and_not_replayed() {
    let server = server(1);
    let planner = Planner::beside().unwrap();
    let mut play = Play::new(&server.address().to_string(), ScriptName::Squeeze, planner);
    play.until("touch", |_, outcome| is_deforming(outcome));
    let first = play.tick - 1;
    play.settled_tick().unwrap();
    // Thirty periods pass without a tick.
    play.session.settle(PATIENCE);
    let outcome = play.tick_after(30).unwrap();
    assert!(is_deforming(&outcome), "the grip has lasted");
    assert!(outcome.answers.len() == 1, "{:?}", outcome.answers);
    while play.settled_tick().is_some() {}
    let report = play.finish();
    check_counts(&report);
    assert_eq!(report.summary.ticks_skipped, 30);
    assert_eq!(json(&report)["unanswered"]["tick_skipped"], 30);
    let played: Vec<u64> =
        report.played.iter().map(|r| r.tick).filter(|tick| *tick >= first).collect();
    assert_eq!(played[..4], [first, first + 1, first + 32, first + 33]);
    // Pressing and holding take 65 ticks by the clock, missed ones included.
    assert!((60..75).contains(&(report.ticks - first)), "{} from {first} on", report.ticks);
}

#[test]
fn ticks_without_a_server_are_counted_as_such() {
    let listener = TcpListener::bind(("127.0.0.1", 0)).unwrap();
    let address = listener.local_addr().unwrap().to_string();
    drop(listener);
    let mut play = Play::new(&address, ScriptName::Squeeze, Planner::beside().unwrap());
    while play.tick_after(0).is_some() {}
    let report = play.finish();
    check_counts(&report);
    let summary = json(&report);
    let deforming = summary["deforming_ticks"].as_u64().unwrap();
    assert!(deforming > 20);
    // All but the last, which still waits for a server when the run ends.
    let count = |why: &str| summary["unanswered"][why].as_u64().unwrap_or(0);
    assert_eq!(count("server_lost") + count("run_ended"), deforming, "{summary}");
    assert!(failure(&report).unwrap().contains("was lost"), "{:?}", failure(&report));
}

#[test]
fn refused_model_is_sent_once_and_told_once() {
    let (address, uploads, frames) = start_refusing_server();
    let planner = Planner::beside().unwrap();
    let mut play = Play::new(&address.to_string(), ScriptName::Squeeze, planner);
    while play.settled_tick().is_some() {}
    let report = play.finish();
    check_counts(&report);
    assert_eq!(uploads.load(Ordering::Relaxed), 1, "the mesh is sent once");
    assert_eq!(frames.load(Ordering::Relaxed), 0, "nothing is asked of a model that is not there");
    let told: Vec<_> = report.events.iter().filter(|e| e.what.starts_with("refused")).collect();
    assert_eq!(told.len(), 1, "{told:?}");
    assert_eq!(told[0].what, "refused the model (MemoryLimit): it needs 9 bytes");
    let summary = json(&report);
    assert_eq!(summary["unanswered"]["refused"], summary["deforming_ticks"]);
    assert!(
        failure(&report).unwrap().ends_with("refused the model (MemoryLimit): it needs 9 bytes")
    );
}

/// Server that refuses every model, and the numbers of models and questions that it received.
fn start_refusing_server() -> (SocketAddr, Arc<AtomicUsize>, Arc<AtomicUsize>) {
    let listener = TcpListener::bind(("127.0.0.1", 0)).unwrap();
    let address = listener.local_addr().unwrap();
    let counters = (Arc::new(AtomicUsize::new(0)), Arc::new(AtomicUsize::new(0)));
    let (uploads, frames) = (Arc::clone(&counters.0), Arc::clone(&counters.1));
    std::thread::spawn(move || {
        let limits = Limits::default();
        for stream in listener.incoming().flatten() {
            let mut connection = Connection::new(stream, limits);
            while let Ok(Some(frame)) = connection.read_frame() {
                let reply = match Request::decode(&frame, &limits) {
                    Ok(Request::Hello(_)) => Reply::Welcome(Welcome {
                        server: "refusing".to_owned(),
                        version: "0".to_owned(),
                        threads: 1,
                        ..Welcome::default()
                    }),
                    Ok(Request::HaveModel(_)) => Reply::ModelState { known: false },
                    Ok(Request::UploadModel(_)) => {
                        uploads.fetch_add(1, Ordering::Relaxed);
                        Reply::Rejected(Rejected::new(
                            RejectCode::MemoryLimit,
                            "it needs 9 bytes; take a smaller one, or wait",
                        ))
                    }
                    Ok(Request::Ask(_)) => {
                        frames.fetch_add(1, Ordering::Relaxed);
                        return;
                    }
                    _ => continue,
                };
                let mut out = Vec::new();
                reply.encode_into(frame.request_id(), &limits, &mut out).unwrap();
                connection.write_bytes(&out).unwrap();
            }
        }
    });
    (address, counters.0, counters.1)
}
