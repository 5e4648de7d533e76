//! Keep shape: the old model answers while the new one is made, and a shape with elements turned
//! inside out is not kept.

use glove_client::ask::link::Link;
use glove_client::ask::solve_settings::SolveSettings;
use glove_client::pace::Pace;
use glove_client::pace::tick_budget::Priority;
use glove_client::run::grasp_loop::GraspLoop;
use glove_client::run::tick_outcome::LoopEvent;
use nalgebra::Isometry3;
use softgrasp_core::mesh::TetMesh;
use softgrasp_grasp::grasp::{Command, Grasp, StateName};
use softgrasp_grasp::object::{ContactModel, SoftObject};
use softgrasp_hand::hand_reader::HandReader;
use softgrasp_hand::hand_setup::HandSetup;
use softgrasp_hand::scripted::{ScriptName, ScriptedHand, Seen};
use softgrasp_protocol::{ModelHash, Reply, Request};
use softgrasp_tests::fake_server::start_fake_server;
use softgrasp_tests::questions::{cube, frame, upload};
use softgrasp_tests::raw_session::{RawSession, request_frame};

use crate::settings::linear_settings;
use crate::start::{answer, client, server};

/// Mesh after a squeeze: another rest shape, and another model.
fn kept(mesh: &TetMesh) -> TetMesh {
    let squeezed = mesh.vertices().iter().map(|p| {
        let mut p = *p;
        p.y *= 0.9;
        p
    });
    mesh.with_vertices(squeezed.collect()).unwrap()
}

#[test]
fn old_model_answers_while_the_new_one_is_made_and_after() {
    for threads in [1, 2] {
        let server = server(threads);
        let mut connection = client(&server);
        let (old, new) = (cube(343), kept(&cube(3375)));
        connection.ask(&Request::UploadModel(upload(&old))).unwrap();
        let asked = Request::from(frame(&old, 1.0, "auto"));
        // Strain and bound come from beside the frames; the displacements may not depend on it.
        let mut shape = || answer(&mut connection, &asked).displacements;
        let expected = shape();
        let mut maker = RawSession::open(server.address());
        let order = upload(&new);
        maker.send(&request_frame(1, &Request::UploadModel(order.clone())));
        for _ in 0..10 {
            assert!(shape() == expected);
        }
        match maker.reply() {
            Some((1, Reply::ModelReady(ready))) => assert_eq!(ready.model, ModelHash::of(&order)),
            other => panic!("the upload got {other:?}"),
        }
        // Both are kept: the client that goes on with the new shape takes nothing from the others.
        assert!(shape() == expected);
        let asked_new = Request::from(frame(&new, 1.0, "auto"));
        assert_eq!(answer(&mut connection, &asked_new).displacements.node_count(), 3375);
    }
}

#[test]
fn shape_with_elements_inside_out_is_not_kept_and_the_grasp_goes_on() {
    let mesh = cube(216);
    let object = SoftObject::try_new(mesh.clone()).unwrap();
    // A node inside the cube is thrown out of it, so that no contact changes.
    let surface = &object.surface().nodes;
    let inner = (0..216).find(|n| !surface.contains(n)).unwrap();
    let mut displacements = vec![[0.0; 3]; 216];
    displacements[inner as usize] = [0.0, 0.5, 0.0];
    let address = start_fake_server(displacements).to_string();

    let setup = HandSetup::default();
    let mut hand = ScriptedHand::try_new(ScriptName::Squeeze, setup.clone(), &object).unwrap();
    let settings = SolveSettings { contact: ContactModel::Vertex, ..linear_settings() };
    let grasp = Grasp::try_new(Isometry3::identity(), Grasp::RELEASE_MARGIN_M).unwrap();
    let (reader, link) =
        (HandReader::new(setup), Link::start(&address, Priority::Ordinary).unwrap());
    let mut grasp_loop =
        GraspLoop::try_new(reader, object, grasp, link, settings, Pace::Lockstep).unwrap();

    let (mut seen, mut answered, mut refused, mut answered_after) = (Seen::default(), 0, None, 0);
    for tick in 0..2000 {
        let mut sent = hand.next(&seen, grasp_loop.object());
        sent.command = (answered == 3).then_some(Command::KeepShape);
        let outcome = grasp_loop.tick(tick, tick as f64 / 60.0, &sent).unwrap();
        seen = outcome.seen;
        answered += outcome.answers.len();
        for event in outcome.events {
            if let LoopEvent::KeepRefused(text) = event {
                assert_eq!(outcome.state, Some(StateName::Deforming), "the grasp goes on");
                refused = Some(text);
            }
        }
        answered_after += usize::from(refused.is_some() && !outcome.answers.is_empty());
        if answered_after > 2 {
            break;
        }
    }
    let text = refused.expect("the command was given");
    for part in ["elements would be turned inside out", "of its volume", "open the hand"] {
        assert!(text.contains(part), "'{part}' is missing in: {text}");
    }
    assert!(answered_after > 2, "no more answers after the refusal");
    assert_eq!(grasp_loop.object().rest_shapes(), 1);
    assert!(grasp_loop.object().rest().vertices() == mesh.vertices());
}
