//! Shape of an object that has flowed, after the hand lets go.

use glove_client::ask::link::Link;
use glove_client::ask::solve_settings::Elasticity;
use glove_client::ask::solve_settings::SolveSettings;
use glove_client::pace::Pace;
use glove_client::pace::tick_budget::Priority;
use glove_client::run::grasp_loop::GraspLoop;
use nalgebra::Isometry3;
use softgrasp_core::mesh::{BuiltIn, TetMesh};
use softgrasp_grasp::grasp::{Grasp, StateName};
use softgrasp_grasp::object::SoftObject;
use softgrasp_hand::hand_reader::HandReader;
use softgrasp_hand::hand_setup::HandSetup;
use softgrasp_hand::scripted::{ScriptName, ScriptedHand, Seen};
use softgrasp_protocol::{Deformation, LawName};

use crate::settings::{linear_settings, sized};
use crate::start::server;

/// Depth of the largest dent of a squeezed strawberry, relative to the depth of the press, and number of
/// its rest shapes.
fn squeezed(mesh: &TetMesh, yield_stress: f64, pace: Pace) -> (f64, u64) {
    let server = server(2);
    let object = SoftObject::try_new(mesh.clone()).unwrap();
    let setup = HandSetup::default();
    let mut hand = ScriptedHand::try_new(ScriptName::Release, setup.clone(), &object).unwrap();
    let settings = SolveSettings {
        elasticity: Elasticity {
            deformation: Deformation::Auto,
            law: LawName::NeoHookean,
            yield_stress: Some(yield_stress),
        },
        ..linear_settings()
    };
    let grasp = Grasp::try_new(Isometry3::identity(), Grasp::RELEASE_MARGIN_M).unwrap();
    let link = Link::start(server.address().to_string(), Priority::Ordinary).unwrap();
    let reader = HandReader::new(setup);
    let mut grasp_loop = GraspLoop::try_new(reader, object, grasp, link, settings, pace).unwrap();
    let (mut seen, mut pressed, mut let_go) = (Seen::default(), 0.0f64, false);
    for tick in 0..1000 {
        let sent = hand.next(&seen, grasp_loop.object());
        if sent.over {
            break;
        }
        if pace == Pace::Free {
            std::thread::sleep(std::time::Duration::from_millis(10));
        }
        let outcome = grasp_loop.tick(tick, tick as f64 / 60.0, &sent).unwrap();
        seen = outcome.seen;
        if outcome.state == Some(StateName::Deforming) {
            let moved = grasp_loop.object().displacement().iter();
            pressed = moved.map(|u| nalgebra::Vector3::from(*u).norm()).fold(pressed, f64::max);
        }
        let_go |= pressed > 0.0 && outcome.state != Some(StateName::Deforming);
    }
    assert!(let_go && pressed > 1e-3, "squeezed by {pressed} m");
    let left = grasp_loop.object().shape().iter().zip(mesh.vertices());
    let dent = left.map(|(now, before)| (now - before).norm()).fold(0.0, f64::max);
    (dent / pressed, grasp_loop.object().rest_shapes())
}

fn strawberry() -> TetMesh {
    sized(BuiltIn::Strawberry, 300, 0.08)
}

#[test]
fn squeezed_objects_that_flow_spring_back_a_little_and_stay_dented() {
    let mesh = strawberry();
    for pace in [Pace::Lockstep, Pace::Free] {
        let (dent, rest_shapes) = squeezed(&mesh, 1.0e3, pace);
        assert_eq!(rest_shapes, 2, "{pace:?}: the dented shape is the next rest shape");
        assert!(dent > 0.2 && dent < 0.98, "{pace:?}: {dent} of what was pressed in is left");
    }
}

#[test]
fn objects_that_do_not_flow_come_back_to_the_bit() {
    let (dent, rest_shapes) = squeezed(&strawberry(), 1.0e9, Pace::Lockstep);
    assert_eq!((dent, rest_shapes), (0.0, 1));
}
