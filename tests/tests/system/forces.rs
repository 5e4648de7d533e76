//! Forces of the fingertips while a strawberry is squeezed: they balance, they do work on the
//! object, and they are there as long as the hand deforms it.

use glove_client::ask::link::Link;
use glove_client::ask::solve_settings::SolveSettings;
use glove_client::pace::Pace;
use glove_client::pace::tick_budget::Priority;
use glove_client::run::grasp_loop::GraspLoop;
use nalgebra::{Isometry3, Vector3};
use softgrasp_core::mesh::{BuiltIn, generate};
use softgrasp_grasp::grasp::{Grasp, StateName};
use softgrasp_grasp::object::{ContactModel, SoftObject};
use softgrasp_hand::hand_reader::HandReader;
use softgrasp_hand::hand_setup::HandSetup;
use softgrasp_hand::scripted::{ScriptName, ScriptedHand, Seen};
use softgrasp_protocol::ElementName;

use crate::settings::linear_settings;
use crate::start::server;

/// Plays a squeeze to the end of the script; `see` is called after each tick with the state.
fn squeeze(contact: ContactModel, forces: bool, mut see: impl FnMut(&GraspLoop, StateName)) {
    let server = server(1);
    let object = SoftObject::try_new(generate(BuiltIn::Strawberry, 400).unwrap()).unwrap();
    let setup = HandSetup::default();
    let mut hand = ScriptedHand::try_new(ScriptName::Release, setup.clone(), &object).unwrap();
    let settings = SolveSettings { element: ElementName::T4Anp, contact, ..linear_settings() };
    let grasp = Grasp::try_new(Isometry3::identity(), Grasp::RELEASE_MARGIN_M).unwrap();
    let link = Link::start(server.address().to_string(), Priority::Ordinary).unwrap();
    let reader = HandReader::new(setup);
    let mut grasp_loop =
        GraspLoop::try_new(reader, object, grasp, link, settings, Pace::Lockstep).unwrap();
    grasp_loop.wishes_mut().forces = forces;
    let mut seen = Seen::default();
    for tick in 0..2000 {
        let sent = hand.next(&seen, grasp_loop.object());
        if sent.over {
            return;
        }
        let outcome = grasp_loop.tick(tick, tick as f64 / 60.0, &sent).unwrap();
        seen = outcome.seen;
        if let Some(state) = outcome.state {
            see(&grasp_loop, state);
        }
    }
    panic!("the script does not end");
}

#[test]
fn forces_of_a_squeezed_strawberry_balance_and_do_work_on_it() {
    for contact in [ContactModel::Vertex, ContactModel::Patch, ContactModel::Mask] {
        let mut largest_seen = 0.0_f64;
        squeeze(contact, true, |grasp_loop, state| {
            let forces = grasp_loop.fingertip_forces();
            let held = grasp_loop.contacts();
            assert_eq!(forces.is_some(), state == StateName::Deforming, "{contact} in {state}");
            let Some(forces) = forces else {
                assert_eq!(held.iter().any(Option::is_some), state == StateName::Attached);
                return;
            };
            let largest = forces.iter().map(Vector3::norm).fold(0.0, f64::max);
            let sum: Vector3<f64> = forces.iter().sum();
            assert!(sum.norm() <= 1e-9 * largest, "{contact}: {sum} of {largest} N is left over");
            largest_seen = largest_seen.max(largest);
            let nodes = held.map(|contact| contact.unwrap().node as usize);
            // Of a vertex it is known where its force acts, and how far it has moved.
            if contact == ContactModel::Vertex && largest > 0.0 {
                let object = grasp_loop.object();
                let at_rest = |node: usize| object.rest().vertices()[node].coords;
                let by_finger = || nodes.iter().zip(&forces);
                let torque: Vector3<f64> = by_finger().map(|(&n, f)| at_rest(n).cross(f)).sum();
                let size = object.rest().size();
                assert!(torque.norm() <= 1e-9 * largest * size, "a torque of {torque} is left");
                let moved = |node: usize| Vector3::from(object.displacement()[node]);
                let work: f64 = by_finger().map(|(&n, f)| moved(n).dot(f)).sum();
                assert!(work > 0.0, "the fingers take energy out of the object: {work} J");
            }
        });
        assert!((0.01..100.0).contains(&largest_seen), "{contact}: at most {largest_seen} N");
    }
}

#[test]
fn without_being_asked_for_there_are_no_forces() {
    let mut deforming = 0;
    squeeze(ContactModel::Mask, false, |grasp_loop, state| {
        deforming += u32::from(state == StateName::Deforming);
        assert_eq!(grasp_loop.fingertip_forces(), None);
    });
    assert!(deforming > 0);
}
