//! The first minute in the default view of the window: a lifted object stays in the picture, and a kept
//! dent is visible.

use nalgebra::{Point3, Vector3};
use softgrasp_core::mesh::BuiltIn;
use softgrasp_window::view::camera::ViewCamera;
use softgrasp_window::view::directed_eye::DirectedEye;
use softgrasp_window::view::frame::ViewFrame;
use softgrasp_window::view::pointer::{PointedAt, pointed_at};
use softgrasp_window::view::ray_hit::ray_hit;

use glove_client::pace::Due;
use glove_client::run::contact_grasp::ContactScene;
use glove_client::run::observer::{Foresight, Observer};
use softgrasp_hand::hand_source::HandSource;

use crate::lift::{Lift, object};

/// Width over height of the smallest window that is tested, and its height in pixels.
const ASPECT: f64 = 800.0 / 600.0;
const HEIGHT: f64 = 600.0;

/// Plays the story; `seen` gets the frame and the view after every tick. Returns the last frame.
fn story(mut seen: impl FnMut(&ViewFrame, &ViewCamera)) -> ViewFrame {
    let mesh = object(BuiltIn::Strawberry, 1000, 0.08);
    let mut lift = Lift::of(mesh, ContactScene::default());
    let (mut observer, mut foresight) = (Observer::default(), Foresight::default());
    let (mut eye, mut camera) = (DirectedEye::new(false), ViewCamera::default());
    let mut last = None;
    while let Some(outcome) = lift.tick() {
        let due = Due { tick: lift.tick - 1, skipped: 0 };
        observer.note(due, &outcome);
        let mut frame = observer.frame(due, due.tick as f64 / 60.0, &outcome, &lift.grasp_loop);
        let hand = HandSource::from(lift.hand);
        frame.acts = foresight.acts(&hand, &lift.grasp_loop);
        let HandSource::Scripted(hand) = hand else { unreachable!("it was scripted") };
        lift.hand = hand;
        camera = eye.eye(&frame, camera, frame.at_s).unwrap_or(camera);
        seen(&frame, &camera);
        last = Some(frame);
    }
    last.unwrap()
}

/// Position of a point in the picture, pixels from its middle.
fn pixels(camera: &ViewCamera, place: &Point3<f64>) -> Vector3<f64> {
    let (at, _) = camera.project(place, ASPECT).unwrap();
    0.5 * HEIGHT * Vector3::new(at.x, at.y, 0.0)
}

#[test]
fn lifted_object_stays_in_the_middle_of_the_picture_and_the_kept_dent_is_seen_at_the_end() {
    let mut first_rest = None;
    let mut eye = ViewCamera::default();
    let mut raised = 0.0f64;
    let last = story(|frame, camera| {
        let rest = &frame.object.rest;
        first_rest.get_or_insert_with(|| rest.mesh().vertices().to_vec());
        let middle = frame.object.world_from_object * rest.centre();
        raised = raised.max(middle.y);
        let at = pixels(camera, &middle);
        assert!(at.norm() < 110.0, "tick {}: its middle is {at} from the picture's", frame.tick);
        eye = *camera;
    });
    assert!(raised > 0.05, "it was raised to {raised} m");
    let before = first_rest.unwrap();
    let mesh = last.object.rest.mesh();
    let world = |p: &Point3<f64>| last.object.world_from_object * p;
    let triangles: Vec<[Point3<f64>; 3]> = last
        .object
        .rest
        .surface()
        .triangles
        .iter()
        .map(|t| t.map(|node| world(&mesh.vertices()[node as usize])))
        .collect();
    let dent = |node: u32| (mesh.vertices()[node as usize] - before[node as usize]).norm();
    let nodes = &last.object.rest.surface().nodes;
    let deepest = nodes.iter().map(|&node| dent(node)).fold(0.0, f64::max);
    assert!(deepest > 2e-3, "the kept dent is {deepest} m deep");
    let (mut seen, mut dented, mut most_pixels) = (0, 0, 0.0f64);
    for &node in nodes.iter().filter(|&&node| dent(node) > 0.5 * deepest) {
        dented += 1;
        let place = world(&mesh.vertices()[node as usize]);
        let towards = eye.eye() - place;
        let is_hidden = triangles.iter().any(|t| {
            ray_hit(t, &place, &towards).is_some_and(|(way, _)| way * towards.norm() > 5e-4)
        });
        let in_front = pointed_at(&last, &eye.eye(), &-towards.normalize());
        if !is_hidden && in_front != PointedAt::Hand {
            seen += 1;
            let was = world(&before[node as usize]);
            most_pixels = most_pixels.max((pixels(&eye, &place) - pixels(&eye, &was)).norm());
        }
    }
    println!("dent {deepest} m, {seen} of {dented} places seen, moved by {most_pixels} pixels");
    assert!(4 * seen >= dented, "{seen} of {dented} dented places are seen");
    assert!(most_pixels > 5.0, "the dent is {most_pixels} pixels deep");
}
