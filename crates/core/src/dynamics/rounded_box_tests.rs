//! Boxes with rounded edges pressed into a soft ball on a table.

use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};

use super::tests::{Object, at, table};
use super::*;
use crate::mesh::BuiltIn;
use crate::rigid_body::RigidShape;

/// Diameter of the ball, m.
const SIZE: f64 = 0.06;
const STEPS: u32 = 20;

/// Outcomes of all steps in which a body, turned as it is, comes down onto the ball by a way.
///
/// Units: `lowest` the body's lowest point from its origin, and `way`, m.
fn pressed(
    shape: &RigidShape,
    turn: UnitQuaternion<f64>,
    lowest: Vector3<f64>,
    way: f64,
) -> Vec<StepOutcome> {
    let ball = Object::sized(BuiltIn::Sphere, 600, SIZE, 2.0e4, 0.4);
    let mut state = ObjectState::at_rest(at(0.0, 0.0, 0.5 * SIZE));
    // A little aside of the ball's top.
    let tip = |k: u32| Vector3::new(0.004, -0.002, SIZE - way * f64::from(k) / f64::from(STEPS));
    let pose = |k: u32| Isometry3::from_parts(Translation3::from(tip(k) - lowest), turn);
    let step = |k: u32| {
        let body = MovingBody {
            world_from_body_start: pose(k),
            world_from_body_end: pose(k + 1),
            ..MovingBody::resting(shape.clone(), pose(k), 0.8)
        };
        let found = ball.advance(&state, &[table(0.8), body], StepSettings::default());
        state = found.state.clone();
        found
    };
    (0..STEPS).map(step).collect()
}

#[test]
fn edge_and_corner_of_a_rounded_box_press_into_a_ball_and_every_step_converges() {
    let half = Vector3::new(0.03, 0.02, 0.01);
    let shape = RigidShape::rounded_cuboid(half, 0.001).unwrap();
    let on_an_edge = UnitQuaternion::from_euler_angles(0.8, 0.1, 0.0);
    let on_a_corner = UnitQuaternion::from_euler_angles(0.7, 0.6, 0.3);
    for turn in [on_an_edge, on_a_corner] {
        let corners = (0..8).map(|k| {
            let sign = |bit: u32| if k & bit == 0 { -1.0 } else { 1.0 };
            turn * half.component_mul(&Vector3::new(sign(1), sign(2), sign(4)))
        });
        let lowest = corners.min_by(|a, b| a.z.total_cmp(&b.z)).unwrap();
        let found = pressed(&shape, turn, lowest, 0.012);
        for (k, step) in found.iter().enumerate() {
            assert!(step.is_converged, "step {k} leaves {}", step.contact_residual_rel);
        }
        let forces: Vec<f64> = found.iter().map(|step| step.loads[1].normal_force).collect();
        assert!(forces[19] > forces[12] && forces[12] > 0.1, "{forces:?}");
    }
}

#[test]
fn box_rounded_to_a_ball_presses_as_a_ball_does() {
    let turn = UnitQuaternion::from_euler_angles(0.5, 0.2, 0.1);
    let lowest = Vector3::new(0.0, 0.0, -0.01);
    let last = [
        RigidShape::sphere(0.01).unwrap(),
        RigidShape::rounded_cuboid(Vector3::repeat(0.01), 0.01).unwrap(),
    ]
    .map(|shape| pressed(&shape, turn, lowest, 0.008).pop().unwrap());
    let [ball, cube] = last.map(|step| step.loads[1].force);
    assert!(ball.norm() > 0.1, "{ball}");
    assert!((ball - cube).norm() < 1e-4 * ball.norm(), "{ball} {cube}");
}
