//! Tests of the grasp with real geometry: colliders, a sphere tree and the state machine.

use nalgebra::{Isometry3, Point3, Unit, Vector3};
use proptest::prelude::*;

use super::event::{GraspEvent, StepInput, StepOutput};
use super::sense::sense;
use super::state::StateName;
use super::step::{Grasp, GraspError};
use crate::hand::{Finger, FingerColliders, HandColliders};
use crate::shape::{Cylinder, Sphere};
use crate::sphere_tree::SphereTree;

/// Ball of 2 000 vertices, radius 3.5 cm, with its exact normals.
fn ball() -> (SphereTree, Vec<Vector3<f64>>) {
    let normals: Vec<Vector3<f64>> = (0..2000)
        .map(|i| {
            let z = 1.0 - (f64::from(i) + 0.5) / 1000.0;
            let (sin, cos) = (f64::from(i) * 2.399_963).sin_cos();
            Vector3::new(cos * (1.0 - z * z).sqrt(), sin * (1.0 - z * z).sqrt(), z)
        })
        .collect();
    let points: Vec<_> = normals.iter().map(|n| Point3::from(n * 0.035)).collect();
    let all: Vec<u32> = (0..2000).collect();
    (SphereTree::try_build(&points, &all).unwrap(), normals)
}

/// Five straight fingers that point at the ball's centre; `gaps` from contact point to surface.
fn fingers_around(gaps: [f64; 5]) -> HandColliders {
    let angles: [f64; 5] = [3.1, -0.7, 0.0, 0.7, 1.4];
    let fingers = std::array::from_fn(|finger| {
        let (sin, cos) = angles[finger].sin_cos();
        let outward = Unit::new_normalize(Vector3::new(cos, sin, 0.1));
        let contact_point = Point3::from(outward.into_inner() * (0.035 + gaps[finger]));
        let along = |d: f64| contact_point + outward.into_inner() * d;
        // The tip sphere's foremost point is the contact point.
        let segment =
            |from: f64| Cylinder { base: along(from), axis: outward, length: 0.03, radius: 0.007 };
        FingerColliders {
            finger: Finger::ALL[finger],
            cylinders: [segment(0.067), segment(0.037), segment(0.007)],
            tip: Sphere { centre: along(0.007), radius: 0.007 },
            contact_point,
        }
    });
    HandColliders { fingers }
}

struct Scene {
    tree: SphereTree,
    normals: Vec<Vector3<f64>>,
    grasp: Grasp,
}

impl Scene {
    fn new(home: Isometry3<f64>) -> Self {
        let (tree, normals) = ball();
        Self { tree, normals, grasp: Grasp::try_new(home, 0.003).unwrap() }
    }

    fn tick(&mut self, world_from_palm: Isometry3<f64>, gaps: [f64; 5]) -> StepOutput {
        let world_from_object = self.grasp.world_from_object(&world_from_palm);
        let hand = fingers_around(gaps).in_frame(&world_from_palm);
        let fingers = sense(&self.tree, &self.normals, &hand, &world_from_object, 0.003);
        self.grasp.step(&StepInput {
            world_from_palm,
            world_from_segment: [[world_from_palm; 3]; 5],
            fingers,
            command: None,
        })
    }
}

#[test]
fn a_hand_closes_on_a_ball_squeezes_it_and_opens_again() {
    let palm = Isometry3::new(Vector3::new(0.3, 0.1, -0.2), Vector3::new(0.5, 1.0, -0.3));
    let mut scene = Scene::new(palm);
    assert_eq!(scene.tick(palm, [0.02; 5]).state, StateName::Free);
    assert_eq!(scene.tick(palm, [0.02, -0.001, 0.02, 0.02, 0.02]).state, StateName::Avoiding);
    assert_eq!(scene.tick(palm, [0.02, -0.001, -0.001, -0.002, 0.02]).state, StateName::Attached);

    // Carried away, then squeezed with thumb and little finger too.
    let away = Isometry3::new(Vector3::new(-0.4, 0.6, 0.2), Vector3::new(2.0, 0.1, 0.4));
    let output = scene.tick(away, [-0.001; 5]);
    assert_eq!(output.state, StateName::Deforming);
    assert!((output.world_from_object.inverse() * away).translation.vector.norm() < 1e-12);
    let known = scene.tick(away, [-0.006; 5]).known.unwrap();
    for (contact, tip) in known.iter().zip(fingers_around([0.0; 5]).fingers) {
        let inward = -contact.displacement_in_object.dot(&tip.contact_point.coords.normalize());
        assert!((0.0039..=0.0051).contains(&inward), "{inward}");
        let vertex = scene.normals[contact.node as usize] * 0.035;
        assert!((vertex - tip.contact_point.coords).norm() < 0.004);
    }

    let output = scene.tick(away, [0.004; 5]);
    assert_eq!(output.state, StateName::Detached);
    let left_there = output.world_from_object;
    assert_eq!(scene.tick(away, [0.002; 5]).state, StateName::Detached);
    let output = scene.tick(away, [0.01; 5]);
    assert_eq!((output.state, output.world_from_object), (StateName::Free, left_there));
}

#[test]
fn object_is_placed_only_while_nothing_holds_it_and_is_grasped_where_it_stands() {
    let home = Isometry3::identity();
    let turned = Isometry3::new(Vector3::new(0.01, 0.0, 0.02), Vector3::new(0.0, 1.2, 0.4));
    let mut scene = Scene::new(home);
    scene.tick(home, [0.02; 5]);
    scene.tick(home, [-0.001; 5]);
    assert!(scene.grasp.is_held());
    let before = scene.grasp.clone();
    assert_eq!(scene.grasp.place(turned), Err(GraspError::Held));
    let nowhere = Isometry3::translation(f64::NAN, 0.0, 0.0);
    scene.grasp.let_go();
    assert_eq!(scene.grasp.place(nowhere), Err(GraspError::Pose));
    assert_eq!(scene.grasp.world_from_object(&turned), before.world_from_object(&home));
    assert_eq!(scene.grasp.place(turned), Ok(()));
    // Fingers that are inside it there do not hold it before they have left it.
    let place = |scene: &mut Scene, gap| scene.tick(turned, [gap; 5]);
    assert_eq!(place(&mut scene, -0.001).state, StateName::Detached);
    let output = place(&mut scene, 0.02);
    assert_eq!((output.state, output.world_from_object), (StateName::Free, turned));
    assert_eq!(place(&mut scene, -0.001).state, StateName::Attached);
    assert_eq!(*scene.grasp.home(), home);
}

#[test]
fn fingers_that_avoid_an_object_stay_where_they_are_shown_while_it_is_turned() {
    let palm = Isometry3::identity();
    let mut scene = Scene::new(palm);
    scene.tick(palm, [0.02; 5]);
    let shown = scene.tick(palm, [0.02, -0.001, 0.02, 0.02, 0.02]);
    assert_eq!(shown.state, StateName::Avoiding);
    // A ball that is turned is where it was.
    let turned = Isometry3::new(Vector3::zeros(), Vector3::new(0.3, -0.8, 0.1));
    scene.grasp.place(turned).unwrap();
    let output = scene.tick(palm, [0.02, -0.001, 0.02, 0.02, 0.02]);
    assert_eq!((output.state, output.events), (StateName::Avoiding, Vec::new()));
    assert_eq!(output.world_from_object, turned);
    for (now, before) in output.world_from_segment[1].iter().zip(shown.world_from_segment[1]) {
        assert!((now.translation.vector - before.translation.vector).norm() < 1e-12);
        assert!(now.rotation.angle_to(&before.rotation) < 1e-7);
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(20))]

    #[test]
    fn a_noisy_hand_at_the_surface_enters_each_state_at_most_once(
        noise in prop::collection::vec(prop::array::uniform5(-0.0005..0.0005_f64), 400),
    ) {
        let mut scene = Scene::new(Isometry3::identity());
        let mut entered = Vec::new();
        scene.tick(Isometry3::identity(), [0.05; 5]);
        // One sensor count peak to peak, around the very border of contact.
        for gaps in noise {
            let events = scene.tick(Isometry3::identity(), gaps).events;
            entered.extend(events.into_iter().filter(|e| matches!(e, GraspEvent::Entered(_))));
        }
        let count = entered.len();
        entered.sort_unstable();
        entered.dedup();
        prop_assert_eq!(count, entered.len(), "{:?}", entered);
        prop_assert!(entered.contains(&GraspEvent::Entered(StateName::Deforming)));
    }
}
