//! Menu and mouse while a run is played: undo, save, another object, another hand, pause and step.

use std::path::Path;
use std::sync::mpsc::channel;
use std::time::{Duration, Instant};

use glove_client::ask::model_upload::ModelUpload;
use glove_client::object::mesh_file::read_mesh_file;
use glove_client::run::tick_loop::Timing;
use glove_client::run::tick_thread::TickThread;
use nalgebra::Vector3;
use softgrasp_core::mesh::TetMesh;
use softgrasp_grasp::grasp::StateName;
use softgrasp_grasp::object::{ContactModel, SoftObject};
use softgrasp_hand::hand_setup::HandSetup;
use softgrasp_hand::loaded_object::LoadedObject;
use softgrasp_hand::mouse::MouseInput;
use softgrasp_hand::notice::NoticeKind;
use softgrasp_hand::scripted::{PlanRequest, ScriptName};
use softgrasp_protocol::{ElementName, ModelHash};
use softgrasp_tests::questions::cube;
use softgrasp_window::view::control::Control;

use crate::controlled::{Controlled, MATERIAL, summary};

fn model_hash(object: &SoftObject) -> ModelHash {
    ModelUpload::new(object.rest_shape(), 1, MATERIAL, ElementName::T4).hash
}

fn loaded(mesh: TetMesh) -> Box<LoadedObject> {
    let object = SoftObject::try_new(mesh).unwrap();
    let rest = std::sync::Arc::clone(object.rest_shape());
    let plan = PlanRequest::new(rest, HandSetup::default(), ContactModel::default()).grip();
    Box::new(LoadedObject { summary: summary(&object), brought_to_m: None, object, plan })
}

#[test]
fn undone_shape_is_the_earlier_one_to_the_bit() {
    let mut run = Controlled::by_script(cube(216), ScriptName::Squeeze);
    let (rest, hash) = (run.object().rest().vertices().to_vec(), model_hash(run.object()));
    run.ask(Control::UndoKeepShape);
    run.assert_told(NoticeKind::Refused, "nothing to undo");
    run.deform(40);
    run.ask(Control::KeepShape);
    run.until("the shape is kept", |run, _| run.object().rest_shapes() == 2);
    run.assert_told(NoticeKind::Done, "shape kept");
    assert!(model_hash(run.object()) != hash && run.session.grasp_loop().undo_count() == 1);
    run.ask(Control::UndoKeepShape);
    run.until("it is undone", |run, _| run.object().rest_shapes() == 3);
    run.assert_told(NoticeKind::Done, "shape back");
    assert!(run.object().rest().vertices() == rest && run.object().shape() == rest);
    assert_eq!(model_hash(run.object()), hash);
    assert_eq!(run.session.grasp_loop().undo_count(), 0);
    // The server knows the model still, and the object can be squeezed again.
    run.ask(Control::Restart);
    run.deform(5);
    let report = run.finish();
    assert!(report.summary.solves > 40 && report.summary.shapes_kept == 1);
}

#[test]
fn dent_is_gone_when_the_story_is_played_from_the_beginning() {
    let mut run = Controlled::by_script(cube(216), ScriptName::Squeeze);
    let rest = run.object().rest().vertices().to_vec();
    for _ in 0..2 {
        run.deform(40);
        run.ask(Control::KeepShape);
        let kept = run.object().rest_shapes() + 1;
        run.until("the shape is kept", |run, _| run.object().rest_shapes() == kept);
        if run.session.grasp_loop().undo_count() == 1 {
            run.ask(Control::ReplaceHand(scripted_again(&run)));
        }
    }
    assert_eq!(run.session.grasp_loop().undo_count(), 2);
    run.ask(Control::Restart);
    run.until("it is as it was", |run, _| run.object().rest().vertices() == rest);
    run.assert_told(NoticeKind::Done, "that it began with");
    assert_eq!(run.session.grasp_loop().undo_count(), 0);
    run.deform(5);
}

#[test]
fn stiffer_object_takes_more_force_to_squeeze_and_stays_in_the_hand() {
    let mut run = Controlled::by_script(cube(216), ScriptName::Squeeze);
    run.session.apply(Control::SetForces(true));
    run.deform(250);
    let force = |run: &Controlled| {
        let forces = run.session.grasp_loop().fingertip_forces();
        forces.map_or(0.0, |all| all.iter().map(Vector3::norm).sum::<f64>())
    };
    let soft = force(&run);
    assert!(soft > 0.0);
    let stiff = softgrasp_protocol::Material { young: 10.0 * MATERIAL.young, ..MATERIAL };
    run.ask(Control::SetMaterial(stiff));
    run.until("it is of the other material", |run, _| run.object().rest_shapes() == 2);
    run.until("it is squeezed as before", |run, _| force(run) > 0.0);
    assert_eq!(run.session.grasp_loop().state(), StateName::Deforming);
    let ratio = force(&run) / soft;
    // The same displacements of a material ten times as stiff.
    assert!((ratio - 10.0).abs() < 0.5, "{ratio}");
    run.ask(Control::SetMaterial(softgrasp_protocol::Material { poisson: 0.7, ..MATERIAL }));
    run.assert_told(NoticeKind::Refused, "the material is not taken");
}

/// Scripted hand that squeezes the object in its present shape.
fn scripted_again(run: &Controlled) -> Box<softgrasp_hand::hand_source::HandSource> {
    let hand = softgrasp_hand::scripted::ScriptedHand::try_new(
        ScriptName::Squeeze,
        HandSetup::default(),
        run.object(),
    );
    Box::new(hand.unwrap().into())
}

/// Checks that the saved nodes are the present ones, and that the inside follows.
fn assert_saved(path: &Path, run: &Controlled) {
    let saved = read_mesh_file(path).unwrap().mesh;
    let object = run.object();
    let moved = object.rest().vertices().iter().zip(object.displacement());
    for (saved, (rest, u)) in saved.vertices().iter().zip(moved) {
        assert!((saved - (rest + Vector3::from(*u))).norm() < 1e-12);
    }
    assert_eq!(saved.tets(), object.rest().tets());
    let surface = &object.surface().nodes;
    let inside = (0..object.shape().len()).filter(|n| !surface.contains(&(*n as u32)));
    let inside: f64 = inside.map(|n| Vector3::from(object.displacement()[n]).norm()).sum();
    assert!(inside > 0.0, "the inside is where it was");
}

#[test]
fn deformed_object_is_saved_whole_in_every_format() {
    let folder = tempfile::tempdir().unwrap();
    let mut run = Controlled::by_script(cube(216), ScriptName::Squeeze);
    // The script holds to its end: from then on the shape stays as it is.
    run.deform(250);
    for name in ["cube.msh", "cube.vtu", "cube.txt"] {
        let path = folder.path().join(name);
        run.ask(Control::Save(path.clone()));
        run.until("it is saved", |run, _| {
            run.notices.iter().any(|n| n.text.contains(name) && n.kind == NoticeKind::Done)
        });
        run.assert_told(NoticeKind::Done, "216 nodes");
        assert_saved(&path, &run);
    }
    for (name, why) in [("cube.obj", "names no format"), ("no/such/folder.msh", "cannot write")] {
        run.ask(Control::Save(folder.path().join(name)));
        (0..3).for_each(|_| drop(run.tick()));
        run.assert_told(NoticeKind::Refused, why);
    }
    let vtu = std::fs::read_to_string(folder.path().join("cube.vtu")).unwrap();
    assert!(vtu.contains("Name=\"displacement\""));
    assert_eq!(run.tick().state, Some(StateName::Deforming), "nothing of it disturbs the grasp");
}

#[test]
fn object_is_saved_and_a_shape_undone_while_no_tick_is_played() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("cube.msh");
    let mut run = Controlled::by_script(cube(216), ScriptName::Squeeze);
    run.deform(60);
    assert!(!run.object().is_whole());
    run.session.apply(Control::Save(path.clone()));
    let began = Instant::now();
    while !path.exists() && began.elapsed() < Duration::from_secs(30) {
        assert_eq!(run.session.idle().unwrap().state, Some(StateName::Deforming));
        run.session.settle(Duration::from_secs(30));
    }
    assert_saved(&path, &run);
    run.ask(Control::KeepShape);
    run.until("the shape is kept", |run, _| run.object().rest_shapes() == 2);
    run.session.apply(Control::UndoKeepShape);
    let outcome = run.session.idle().unwrap();
    assert_eq!((run.object().rest_shapes(), outcome.state), (3, Some(StateName::Detached)));
    let report = run.finish();
    let answered = report.summary.solves as u64 + report.summary.unanswered.total();
    assert_eq!(report.summary.deforming_ticks, answered, "the question outside is not counted");
}

#[test]
fn object_is_replaced_in_the_middle_of_a_grasp() {
    let mut run = Controlled::by_script(cube(216), ScriptName::Squeeze);
    run.deform(30);
    run.ask(Control::ReplaceObject(loaded(cube(64))));
    run.until("it is there", |run, _| run.object().shape().len() == 64);
    run.assert_told(NoticeKind::Done, "the object is now an object");
    assert!(run.session.grasp_loop().state() != StateName::Deforming);
    assert!(run.object().displacement().iter().flatten().all(|&u| u == 0.0));
    run.ask(Control::UndoKeepShape);
    run.assert_told(NoticeKind::Refused, "nothing to undo");
    // The script begins again, with the plan for the new object, and the server answers for it.
    run.deform(30);
    assert!(run.object().displacement().iter().flatten().any(|&u| u != 0.0));
    run.ask(Control::Mouse(MouseInput::Aim));
    assert_eq!(run.session.hand().name(), "scripted:squeeze");
}

#[test]
fn pause_skips_nothing_and_steps_play_one_tick_each() {
    let run = Controlled::by_script(cube(64), ScriptName::Squeeze);
    let period = Duration::from_millis(4);
    let timing = Timing { period: Some(period), ticks_max: None };
    let (played, ticks) = channel();
    let sink = move |_: &_, _: &_, due: glove_client::pace::Due, _| {
        let _ = played.send(due);
    };
    let Controlled { session, .. } = run;
    let thread = TickThread::start(session, timing, || false, sink).unwrap();
    let patience = Duration::from_secs(30);
    for _ in 0..20 {
        ticks.recv_timeout(patience).unwrap();
    }
    thread.ask(Control::Pause);
    std::thread::sleep(Duration::from_millis(60));
    let before = ticks.try_iter().last().unwrap();
    std::thread::sleep(40 * period);
    assert!(ticks.try_recv().is_err(), "a tick was played while the run was paused");
    for step in 1..=3 {
        thread.ask(Control::Step);
        let due = ticks.recv_timeout(patience).unwrap();
        assert_eq!((due.tick, due.skipped), (before.tick + step, 0));
    }
    thread.ask(Control::Detach);
    thread.ask(Control::Resume);
    let after = ticks.recv_timeout(patience).unwrap();
    // A busy machine may be late by some ticks, but not by the pause.
    assert!(after.skipped < 30, "{after:?}");
    thread.ask(Control::Stop);
    let report = thread.join().unwrap();
    assert!(report.interrupted && report.ticks > before.tick + 3);
}
