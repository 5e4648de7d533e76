//! The mouse hand grasps, lets go, and grasps again from another side, by a few wishes.

use nalgebra::{UnitQuaternion, Vector3};
use softgrasp_core::mesh::{BuiltIn, generate};
use softgrasp_grasp::grasp::StateName;
use softgrasp_hand::hand_source::HandSource;
use softgrasp_hand::mouse::{Digits, MouseInput, SPEED_MAX_M_S};
use softgrasp_hand::notice::NoticeKind;
use softgrasp_window::view::control::Control;

use crate::controlled::Controlled;
use crate::settings::sized;

pub fn wish(run: &mut Controlled, input: MouseInput) {
    run.ask(Control::Mouse(input));
}

/// Waits until the hand has finished its own motion.
pub fn arrive(run: &mut Controlled) {
    let on_its_way = |run: &Controlled| match run.session.hand() {
        HandSource::Mouse(hand) => hand.is_on_its_way(),
        HandSource::Scripted(_)
        | HandSource::Live(_)
        | HandSource::Replay(_)
        | HandSource::Foreign(_) => false,
    };
    run.until("the hand is there", |run, _| !on_its_way(run));
}

/// Reaches the object and closes all fingers to the planned press.
fn grasp(run: &mut Controlled) {
    wish(run, MouseInput::Reach);
    arrive(run);
    wish(run, MouseInput::CloseTo(Digits::All, 2.0));
    run.until_state(StateName::Attached);
    run.deform(60);
    let deepest = run.object().displacement().iter().map(|u| Vector3::from(*u).norm());
    assert!(deepest.fold(0.0, f64::max) > 5e-4, "it is squeezed");
}

fn grasps_and_lets_go(shape: BuiltIn) {
    let mut run = Controlled::by_mouse(generate(shape, 1000).unwrap());
    arrive(&mut run);
    grasp(&mut run);
    wish(&mut run, MouseInput::CloseTo(Digits::All, 0.0));
    run.until_state(StateName::Detached);
    // An open hand may still be close to the object, until it goes back.
    wish(&mut run, MouseInput::Retreat);
    run.until_state(StateName::Free);
    assert!(run.object().displacement().iter().flatten().all(|&u| u == 0.0));
    assert_eq!(run.finish().summary.tracker_faults, 0);
}

#[test]
fn strawberry_is_grasped_by_reach_and_close() {
    grasps_and_lets_go(BuiltIn::Strawberry);
}

#[test]
fn toothpaste_is_grasped_by_reach_and_close() {
    grasps_and_lets_go(BuiltIn::Toothpaste);
}

#[test]
fn cube_is_grasped_by_reach_and_close() {
    grasps_and_lets_go(BuiltIn::Cube);
}

#[test]
fn sphere_is_grasped_by_reach_and_close() {
    grasps_and_lets_go(BuiltIn::Sphere);
}

#[test]
fn strawberry_is_lifted_from_the_table_by_reach_close_and_move() {
    let mut run = Controlled::by_mouse_with_friction(sized(BuiltIn::Strawberry, 400, 0.08));
    let height =
        |run: &Controlled| run.session.grasp_loop().world_from_object().translation.vector.y;
    arrive(&mut run);
    for _ in 0..2 {
        wish(&mut run, MouseInput::Reach);
        arrive(&mut run);
        wish(&mut run, MouseInput::CloseTo(Digits::All, 2.0));
        run.deform(120);
        let lay = height(&run);
        wish(&mut run, MouseInput::Move(Vector3::new(0.0, 0.06, 0.0)));
        (0..90).for_each(|_| drop(run.tick()));
        let raised = height(&run) - lay;
        assert!((raised - 0.06).abs() < 5e-3, "the hand moved 60 mm and the fruit {raised} m");
        // Back to the table, and let go.
        wish(&mut run, MouseInput::Move(Vector3::new(0.0, -0.06, 0.0)));
        (0..90).for_each(|_| drop(run.tick()));
        wish(&mut run, MouseInput::CloseTo(Digits::All, 0.0));
        run.until_state(StateName::Free);
        wish(&mut run, MouseInput::Retreat);
        arrive(&mut run);
        assert!((height(&run) - lay).abs() < 5e-3, "{} after {lay}", height(&run));
    }
}

#[test]
fn shape_is_kept_and_grasped_again_from_another_side() {
    let mut run = Controlled::by_mouse(generate(BuiltIn::Strawberry, 400).unwrap());
    arrive(&mut run);
    grasp(&mut run);
    let gaze = |run: &Controlled| {
        let hand = run.session.grasp_loop().hand().unwrap();
        hand.world_from_palm.rotation * -Vector3::z()
    };
    let first = gaze(&run);
    run.ask(Control::KeepShape);
    run.until("the shape is kept", |run, _| run.object().rest_shapes() == 2);
    run.assert_told(NoticeKind::Done, "shape kept");
    wish(&mut run, MouseInput::AimElsewhere);
    arrive(&mut run);
    grasp(&mut run);
    assert!(gaze(&run).dot(&first) < 0.55, "from the same side");
    // And from where it lies after it was carried and turned in the hand.
    wish(&mut run, MouseInput::Move(Vector3::new(0.05, 0.08, 0.02)));
    wish(&mut run, MouseInput::Turn(UnitQuaternion::from_euler_angles(0.2, 0.4, -0.3)));
    (0..60).for_each(|_| drop(run.tick()));
    wish(&mut run, MouseInput::Retreat);
    arrive(&mut run);
    assert!(run.session.grasp_loop().world_from_object().rotation.angle() > 0.1);
    grasp(&mut run);
}

#[test]
fn jump_of_the_mouse_does_not_throw_the_hand() {
    let mut run = Controlled::by_mouse(generate(BuiltIn::Cube, 64).unwrap());
    arrive(&mut run);
    let palm = |run: &Controlled| {
        run.session.grasp_loop().hand().unwrap().world_from_palm.translation.vector
    };
    run.session.apply(Control::Mouse(MouseInput::Move(Vector3::new(f64::NAN, 0.0, 0.0))));
    run.session.apply(Control::Mouse(MouseInput::Move(Vector3::new(30.0, -20.0, 0.0))));
    let mut before = palm(&run);
    for _ in 0..60 {
        run.tick();
        let now = palm(&run);
        // The tracker's record is as exact as single precision.
        assert!((now - before).norm() <= SPEED_MAX_M_S / 60.0 + 1e-5, "{}", (now - before).norm());
        before = now;
    }
    assert!((before.norm() - 0.45).abs() < 1e-3, "it stays within reach: {before}");
}

#[test]
fn object_is_turned_only_while_nothing_holds_it() {
    let mut run = Controlled::by_mouse(generate(BuiltIn::Cube, 64).unwrap());
    arrive(&mut run);
    let turn = UnitQuaternion::from_euler_angles(0.1, 0.7, 0.0);
    let events = run.ask(Control::TurnObject(turn)).events;
    assert!(events.is_empty(), "{events:?}");
    let stands = *run.session.grasp_loop().world_from_object();
    assert!(stands.rotation.angle_to(&turn) < 1e-9);
    grasp(&mut run);
    let carried = *run.session.grasp_loop().world_from_object();
    run.ask(Control::TurnObject(turn));
    run.assert_told(NoticeKind::Refused, "a hand holds the object");
    assert_eq!(carried, *run.session.grasp_loop().world_from_object());
    run.ask(Control::Detach);
    run.assert_told(NoticeKind::Done, "let go");
    run.ask(Control::ReturnHome);
    assert_eq!(*run.session.grasp_loop().world_from_object(), nalgebra::Isometry3::identity());
}
