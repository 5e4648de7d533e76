//! Steps of contact that take too long: they end at their deadline, when they are cancelled and when their
//! client has gone, and nobody else waits for them.

use std::time::Duration;

use softgrasp_protocol::{
    ContactFrame, Deformation, ObjectState, PathChoice, RejectCode, Reply, Request,
};
use softgrasp_tests::questions::object;
use softgrasp_tests::raw_session::{RawSession, request_frame};
use softgrasp_tests::watchdog::within;

use softgrasp_core::mesh::BuiltIn;

use crate::contact_frames::{STILL, Scene, advance, bits, scene_of};
use crate::start::{client, server};

const LIMIT: Duration = Duration::from_secs(240);
const YIELD_PA: f64 = 2000.0;

/// A step in which a finger comes down through ten usual ones.
fn deep(scene: &Scene, state: ObjectState) -> ContactFrame {
    let mut frame = scene.frame(state.clone(), 0);
    frame.bodies[1].end = scene.frame(state, 9).bodies[1].end;
    frame
}

/// A step that never meets what it asks for.
fn endless(mut frame: ContactFrame) -> ContactFrame {
    frame.ask.residual_rel = 1e-300;
    frame.ask.penetration_rel = 1e-300;
    (frame.ask.rounds_max, frame.ask.newton_max) = (u32::MAX, u32::MAX);
    frame
}

#[test]
fn step_ends_at_its_deadline_and_says_so() {
    let server = server(2);
    let mut connection = client(&server);
    for deformation in [None, Some(Deformation::Large)] {
        let mut scene = Scene::new(&mut connection);
        scene.deformation = deformation;
        let mut with_deadline = |deadline_ms: Option<f64>| {
            let mut frame = deep(&scene, ObjectState::at_rest(STILL));
            frame.ask.path = PathChoice::FromRest;
            frame.ask.deadline_ms = deadline_ms;
            advance(&mut connection, frame)
        };
        let whole = with_deadline(None);
        assert!(whole.contact.is_converged && !whole.contact.is_late, "{:?}", whole.contact);
        assert!(bits(with_deadline(Some(1e9))) == bits(whole.clone()), "other bits");
        for over in [1e-6, 0.0, -1.0] {
            let late = with_deadline(Some(over)).contact;
            assert!(late.is_late && !late.is_converged, "{late:?}");
            assert!(late.rounds < whole.contact.rounds);
            assert!(late.residual_rel.max(late.penetration_max) > 1e-6, "{late:?}");
        }
    }
}

/// The state that is kept in the session alone, what has flowed, is that of before the step.
#[test]
fn step_that_is_cancelled_leaves_a_clay_object_as_it_was() {
    within(LIMIT, "cancelled steps", || {
        let (one, other) = (server(2), server(2));
        let mut connection = client(&one);
        let mut scene = Scene::new(&mut connection);
        scene.deformation = Some(Deformation::Large);
        let clay = |mut frame: ContactFrame| {
            frame.ask.yield_stress = Some(YIELD_PA);
            frame
        };
        let first = advance(&mut connection, clay(deep(&scene, ObjectState::at_rest(STILL))));
        let second = clay(scene.frame(first.state.clone(), 9));
        let expected = advance(&mut connection, second.clone());
        let flowed = [&first, &expected].map(|answer| answer.contact.plastic_strain);
        assert!(flowed[0] > 0.0 && flowed[1] > 1.1 * flowed[0], "{flowed:?}");

        let mut session = RawSession::open(other.address());
        let model = softgrasp_tests::questions::upload(scene.mesh());
        session.ask(1, &Request::UploadModel(model));
        let mut begin = clay(deep(&scene, ObjectState::at_rest(STILL)));
        begin.ask.path = PathChoice::FromRest;
        let begin = Request::ContactFrame(Box::new(begin));
        let begin_anew = |session: &mut RawSession, id: u64| match session.ask(id, &begin) {
            Reply::ContactAnswer(answer) => {
                assert!(bits(*answer) == bits(first.clone()), "other bits")
            }
            other => panic!("a contact frame got {other:?}"),
        };
        begin_anew(&mut session, 2);
        let mut cancelled = 0;
        for (id, wait_ms) in (10..).zip([0, 1, 3, 10, 20, 40]) {
            let endless = endless(second.clone());
            session.send(&request_frame(id, &Request::ContactFrame(Box::new(endless))));
            std::thread::sleep(Duration::from_millis(wait_ms));
            session.send(&request_frame(1000, &Request::Cancel { request_id: id }));
            match session.reply() {
                Some((_, Reply::Rejected(refusal))) => {
                    assert_eq!(refusal.code, RejectCode::Cancelled);
                    cancelled += 1;
                }
                // A machine may be so quick that the step has tried all its shapes by then.
                Some((_, Reply::ContactAnswer(_))) => begin_anew(&mut session, 100 + id),
                other => panic!("an endless step got {other:?}"),
            }
        }
        assert!(cancelled > 0, "none of six steps was cancelled");
        match session.ask(3, &Request::ContactFrame(Box::new(second))) {
            Reply::ContactAnswer(answer) => assert!(bits(*answer) == bits(expected), "other bits"),
            other => panic!("a contact frame got {other:?}"),
        }
    });
}

#[test]
fn endless_steps_of_some_do_not_stop_the_steps_of_others_and_end_with_their_clients() {
    within(LIMIT, "endless steps", || {
        let server = server(1);
        let mut connection = client(&server);
        let scene = Scene::new(&mut connection);
        let large = scene_of(&mut connection, object(BuiltIn::Cube, 3000), None);
        // All columns are there, so that only the time of the contact problem is left.
        let begin = advance(&mut connection, deep(&large, ObjectState::at_rest(STILL)));
        let mut giants: Vec<RawSession> =
            (0..3).map(|_| RawSession::open(server.address())).collect();
        for giant in &mut giants {
            let frame = endless(deep(&large, begin.state.clone()));
            giant.send(&request_frame(1, &Request::ContactFrame(Box::new(frame))));
        }
        let mut state = ObjectState::at_rest(STILL);
        for step in 0..20 {
            state = advance(&mut connection, scene.frame(state, step)).state;
        }
        drop(giants);
        // The thread is free again: nobody waits for what they had begun.
        advance(&mut connection, deep(&large, begin.state));
    });
}
