//! Laws that hold in every scene: uniform pressure passes a patch, a mirrored scene has mirrored answers,
//! forces and torques balance, and nothing creeps.

use nalgebra::{Isometry3, Point3, Translation3, UnitQuaternion, Vector3};

use super::tests::{Object, at, settled, table};
use super::*;
use crate::mesh::{BuiltIn, TetMesh, generate};
use crate::rigid_body::RigidShape;

/// Contact patch test: between two planes without friction a block is pressed evenly, so strain and pressure are
/// the same everywhere, whatever the elements are like, and the force is `E A δ / h`.
///
/// The depth is small, so that the terms of second order that linear elasticity leaves out are.
#[test]
fn block_between_planes_without_friction_has_the_force_and_the_linear_field_of_the_closed_form() {
    let (young, edge, depth): (f64, f64, f64) = (2.0e4, 0.05, 2e-6);
    for nodes in [64, 216, 729] {
        let block = Object::sized(BuiltIn::Cube, nodes, edge, young, 0.3);
        let half_turn = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI);
        let settings = StepSettings {
            gravity: Vector3::zeros(),
            penetration_rel: 1e-12,
            ..StepSettings::default()
        };
        let height = Translation3::new(0.0, 0.0, edge - depth);
        let lid = MovingBody {
            world_from_body_start: Isometry3::from_parts(height, half_turn),
            world_from_body_end: Isometry3::from_parts(height, half_turn),
            ..table(0.0)
        };
        let mut state = ObjectState::at_rest(at(0.0, 0.0, 0.5 * (edge - depth)));
        let mut found = None;
        for _ in 0..30 {
            let outcome = block.advance(&state, &[table(0.0), lid.clone()], settings);
            state = outcome.state.clone();
            found = Some(outcome);
        }
        let found = found.unwrap();
        let expected = young * edge * edge * depth / edge;
        let force = found.loads[1].normal_force;
        assert!((force - expected).abs() < 1e-6 * expected, "{nodes}: {force} N for {expected} N");
        // The surface: every height has gone down in proportion.
        for (&node, moved) in block.surface.nodes.iter().zip(&found.displacements) {
            let rest = block.model.mesh().vertices()[node as usize];
            let height = (state.world_from_object * (rest + Vector3::from(*moved))).z;
            let linear = (rest.z + 0.5 * edge) * (1.0 - depth / edge);
            assert!((height - linear).abs() < 1e-5 * depth, "{nodes}: {height} for {linear}");
        }
    }
}

/// The image of a mesh in the plane x = 0.
fn mirrored(mesh: &TetMesh) -> TetMesh {
    let vertices = mesh.vertices().iter().map(|p| Point3::new(-p.x, p.y, p.z)).collect();
    let tets = mesh.tets().iter().map(|&[a, b, c, d]| [b, a, c, d]).collect();
    TetMesh::try_new(vertices, tets, mesh.regions().to_vec()).unwrap()
}

#[test]
fn mirrored_object_and_fingers_have_mirrored_places_and_forces() {
    let of = |mesh: TetMesh, side: f64| {
        let fruit = Object::new(mesh, 2.0e4, 0.4);
        let (low, _) = fruit.model.mesh().bounds();
        let settings =
            StepSettings { viscosity: 0.02, residual_rel: 1e-11, ..StepSettings::default() };
        let mut state = ObjectState::at_rest(at(0.0, 0.0, -low.z));
        let mut outcomes = Vec::new();
        // Obliquely into the flank, and on along it.
        let pose = |k: f64| at(side * (0.046 - 0.0012 * k), 0.004 + 0.0006 * k, 0.036 - 0.0004 * k);
        for k in 0..12 {
            let tip = MovingBody {
                world_from_body_start: pose(f64::from(k)),
                world_from_body_end: pose(f64::from(k + 1)),
                ..MovingBody::resting(RigidShape::sphere(0.009).unwrap(), pose(0.0), 0.6)
            };
            let found = fruit.advance(&state, &[table(0.6), tip], settings);
            state = found.state.clone();
            outcomes.push(found);
        }
        outcomes
    };
    let mesh = generate(BuiltIn::Strawberry, 300).unwrap();
    let scaled = mesh.vertices().iter().map(|p| p * (0.08 / mesh.size())).collect();
    let mesh = mesh.with_vertices(scaled).unwrap();
    let (here, there) = (of(mesh.clone(), 1.0), of(mirrored(&mesh), -1.0));
    let most = here.iter().map(|o| o.loads[1].force.norm()).fold(0.0, f64::max);
    assert!(most > 0.05, "the finger never pressed: {most} N");
    let in_mirror = |v: &Vector3<f64>| Vector3::new(-v.x, v.y, v.z);
    for (step, (a, b)) in here.iter().zip(&there).enumerate() {
        let place = |o: &StepOutcome| o.state.world_from_object.translation.vector;
        let moved = (in_mirror(&place(a)) - place(b)).norm();
        assert!(moved < 1e-7, "step {step}: {moved:e} m apart");
        for (load, image) in a.loads.iter().zip(&b.loads) {
            let off = (in_mirror(&load.force) - image.force).norm();
            assert!(off < 1e-4 * most, "step {step}: {off:e} N of {most} N");
        }
    }
}

#[test]
fn forces_and_torques_of_table_and_finger_balance_the_weight_of_an_object_at_rest() {
    let cube = Object::sized(BuiltIn::Cube, 216, 0.05, 2.0e4, 0.4);
    let settings = StepSettings { viscosity: 0.01, ..StepSettings::default() };
    let (mut state, _) = settled(&cube, ObjectState::at_rest(at(0.0, 0.0, 0.025)), 40);
    let tip_at = |depth: f64| at(0.008, -0.006, 0.058 - depth);
    let mut found = None;
    for step in 0..120 {
        let depth = |k: i32| 0.0001 * f64::from(k.min(30));
        let tip = MovingBody {
            world_from_body_start: tip_at(depth(step)),
            world_from_body_end: tip_at(depth(step + 1)),
            ..MovingBody::resting(RigidShape::sphere(0.008).unwrap(), tip_at(0.0), 0.7)
        };
        let outcome = cube.advance(&state, &[table(0.7), tip], settings);
        state = outcome.state.clone();
        found = Some(outcome);
    }
    let found = found.unwrap();
    let weight = 9.81 * cube.mass();
    let sum: Vector3<f64> = found.loads.iter().map(|load| load.force).sum();
    let unbalanced = (sum - Vector3::new(0.0, 0.0, weight)).norm();
    assert!(found.loads[1].normal_force > 0.05, "{:?}", found.loads);
    assert!(unbalanced < 1e-6 * weight, "{unbalanced:e} N of {weight} N");
    // Each force once more at the point where it acts, about the middle of the mass.
    let middle = state.world_from_object.translation.vector;
    let torque: Vector3<f64> =
        found.contacts.iter().map(|c| (c.place.coords - middle).cross(&c.force)).sum();
    let of_points: Vector3<f64> = found.contacts.iter().map(|c| c.force).sum();
    assert!((of_points - sum).norm() < 1e-9 * weight);
    // The mass has moved by the mean of the displacements, which the rigid motion does not have.
    assert!(torque.norm() < 1e-4 * weight * 0.05, "{torque}");
}

#[test]
fn block_below_the_angle_of_friction_does_not_creep_in_ten_minutes() {
    let cube = Object::sized(BuiltIn::Cube, 27, 0.05, 1.0e5, 0.3);
    let tilt = 0.5f64.atan() - 0.02;
    let gravity = 9.81 * Vector3::new(tilt.sin(), 0.0, -tilt.cos());
    let settings =
        StepSettings { gravity, viscosity: 0.02, seconds: 0.1, ..StepSettings::default() };
    let mut state = ObjectState::at_rest(at(0.0, 0.0, 0.025));
    let mut settled_at = 0.0;
    for step in 0..6000 {
        state = cube.advance(&state, &[table(0.5)], settings).state;
        if step == 50 {
            settled_at = state.world_from_object.translation.x;
        }
    }
    let crept = (state.world_from_object.translation.x - settled_at).abs();
    assert!(crept < 1e-7, "it crept by {crept:e} m");
}

/// On a fine surface the points of a fingertip say nearly the same, and a force that moves to the deepest
/// point of its triangle tilts the triangle: seven of ten steps ended short of the law.
#[test]
fn every_step_of_a_ball_that_five_fingertips_pinch_lift_and_hold_meets_the_law() {
    let ball = Object::sized(BuiltIn::Sphere, 1000, 0.07, 5.0e4, 0.4);
    let (tip, friction) = (RigidShape::sphere(0.008).unwrap(), 0.8);
    let settings = StepSettings {
        seconds: 1.0 / 60.0,
        viscosity: 0.02,
        residual_rel: 1e-6,
        ..StepSettings::default()
    };
    // Steps: 10 to settle, 40 to close, 30 to lift, 20 to hold.
    let ease = |t: f64| t.clamp(0.0, 1.0).powi(2) * (3.0 - 2.0 * t.clamp(0.0, 1.0));
    let pose = |around: f64, step: f64| {
        let radius = 0.046 - 0.011 * ease((step - 10.0) / 40.0);
        let height = 0.035 + 0.03 * ease((step - 50.0) / 30.0);
        at(radius * around.cos(), radius * around.sin(), height)
    };
    let mut state = ObjectState::at_rest(at(0.0, 0.0, 0.035));
    let mut points = 0;
    for step in 0..100 {
        let mut bodies = vec![table(friction)];
        bodies.extend([std::f64::consts::PI, -0.6, -0.2, 0.2, 0.6].map(|around| MovingBody {
            shape: tip.clone(),
            world_from_body_start: pose(around, f64::from(step)),
            world_from_body_end: pose(around, f64::from(step + 1)),
            friction,
            compliance: 1e-3,
        }));
        let found = ball.advance(&state, &bodies, settings);
        assert!(
            found.is_converged,
            "step {step}: residual {:e} of the largest force, penetration {:e} m",
            found.contact_residual_rel, found.penetration_max
        );
        points = points.max(found.contacts.len());
        state = found.state;
    }
    assert!(points > 15, "{points} points press");
    let height = state.world_from_object.translation.z;
    assert!(height > 0.06, "it is at {height} m");
}
