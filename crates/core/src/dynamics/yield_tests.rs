//! Contact with a material that yields: the plateau and the spring back of a pressed block in closed form, the
//! dents of a pinched ball, and a step that fails.

use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};

use super::tests::{Object, at, table};
use super::*;
use crate::mesh::BuiltIn;
use crate::rigid_body::RigidShape;

/// Settings of a scene without weight, exact enough for closed forms.
fn weightless() -> StepSettings {
    StepSettings { gravity: Vector3::zeros(), residual_rel: 1e-9, ..StepSettings::default() }
}

/// A plane without friction that faces down, at a height at the beginning of a step and at its end.
fn lid(from: f64, to: f64) -> MovingBody {
    let half_turn = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI);
    let pose = |z: f64| Isometry3::from_parts(Translation3::new(0.0, 0.0, z), half_turn);
    MovingBody { world_from_body_start: pose(from), world_from_body_end: pose(to), ..table(0.0) }
}

/// Mean height of the nodes that are highest at rest above those that are lowest, m, in the object's frame.
fn height_of(object: &Object, large: &LargeBody) -> f64 {
    let rest = object.model.mesh().vertices();
    let (low, high) = object.model.mesh().bounds();
    let mean = |at: f64| {
        let of_face =
            object.surface.nodes.iter().filter(|&&n| (rest[n as usize].z - at).abs() < 1e-9);
        let places =
            of_face.map(|&n| rest[n as usize].z + large.displacement()[3 * n as usize + 2]);
        let (sum, count) = places.fold((0.0, 0.0), |(sum, count), z| (sum + z, count + 1.0));
        sum / count
    };
    mean(high.z) - mean(low.z)
}

/// Uniaxial stress: Kirchhoff's stress stays at the yield stress `s`, so that the force is `s A / λ` at the
/// stretch λ, and the elastic logarithmic strain `s / E` is what springs back.
#[test]
fn block_that_yields_between_planes_has_the_force_and_the_spring_back_of_the_closed_form() {
    let (young, edge, stress) = (2.0e4, 0.05, 1.0e3);
    let block = Object::sized(BuiltIn::Cube, 64, edge, young, 0.3);
    let mut large = block.yielding(stress);
    let mut state = ObjectState::at_rest(at(0.0, 0.0, 0.5 * edge));
    let steps = 20;
    let height = |k: i32| edge * (1.0 - 0.2 * f64::from(k) / f64::from(steps));
    let mut force = 0.0;
    for k in 0..steps {
        let bodies = [table(0.0), lid(height(k), height(k + 1))];
        let found = block.advance_large(&mut large, &state, &bodies, weightless());
        assert!(found.is_converged, "step {k}: {:e}", found.residual_rel);
        (force, state) = (found.loads[1].normal_force, found.state);
    }
    let expected = stress * edge * edge / 0.8;
    // The first steps set the block in motion, so that not all of it yields at the same moment.
    assert!((force - expected).abs() < 2e-5 * expected, "{force} N for {expected} N");
    // Both planes are taken away, and the block springs back.
    for _ in 0..3 {
        let found = block.advance_large(&mut large, &state, &[], weightless());
        assert!(found.residual_rel < 1e-9, "unloaded, off by {:e}", found.residual_rel);
        state = found.state;
    }
    let expected = 0.8 * edge * (stress / young).exp();
    let reached = height_of(&block, &large);
    assert!((reached - expected).abs() < 5e-4 * expected, "{reached} m for {expected} m");
    assert!(large.elements().plastic_strain_max() > 0.15);
}

/// A ball between two fingers that close and open again.
fn pinched(stress: Option<f64>) -> (f64, f64) {
    let ball = Object::sized(BuiltIn::Sphere, 300, 0.06, 1.0e4, 0.4);
    let rest = height_of(&ball, &ball.yielding(1.0));
    let mut large = match stress {
        Some(stress) => ball.yielding(stress),
        None => ball.large(crate::fem::hyperelastic::Law::NeoHookean),
    };
    let mut state = ObjectState::at_rest(at(0.0, 0.0, 0.0));
    let radius = 0.01;
    let (mut most, mut found) = (0.0f64, None);
    for k in 0..24 {
        // Closes by 6 mm on each side and opens again.
        let depth = |k: i32| 0.006 * (1.0 - (f64::from(k) / 10.0 - 1.0).abs()).clamp(0.0, 1.0);
        let tip = |side: f64| {
            let place = |k: i32| at(0.0, 0.0, side * (0.5 * rest + radius - depth(k)));
            MovingBody {
                world_from_body_start: place(k),
                world_from_body_end: place(k + 1),
                ..MovingBody::resting(RigidShape::sphere(radius).unwrap(), place(0), 0.5)
            }
        };
        let settings = StepSettings { residual_rel: 1e-6, ..weightless() };
        let made = ball.advance_large(&mut large, &state, &[tip(1.0), tip(-1.0)], settings);
        most = most.max(made.loads[0].normal_force);
        state = made.state.clone();
        found = Some(made);
    }
    let found = found.unwrap();
    assert!(found.loads.iter().all(|load| load.contacts == 0), "the fingers are away");
    assert!(found.residual_rel < 1e-6, "unloaded, off by {:e}", found.residual_rel);
    (most, (rest - height_of(&ball, &large)) / rest)
}

#[test]
fn pinched_ball_of_clay_keeps_its_dents_and_one_of_rubber_does_not() {
    let (rubber, left_of_rubber) = pinched(None);
    assert!(left_of_rubber.abs() < 1e-9, "{left_of_rubber}");
    let (clay, left_of_clay) = pinched(Some(600.0));
    assert!(clay < 0.8 * rubber, "clay presses back by {clay} N, rubber by {rubber} N");
    assert!(left_of_clay > 0.05, "the dents are {left_of_clay} of the ball");
}

/// The finger goes on into a ball that a step has failed for; what has flowed before is still there.
#[test]
fn step_with_a_state_that_no_shape_holds_leaves_what_has_flowed() {
    let ball = Object::sized(BuiltIn::Sphere, 150, 0.06, 1.0e4, 0.4);
    let mut large = ball.yielding(500.0);
    let rest = height_of(&ball, &large);
    let mut state = ObjectState::at_rest(at(0.0, 0.0, 0.5 * rest));
    for k in 0..6 {
        let height = |k: i32| rest * (1.0 - 0.04 * f64::from(k));
        let bodies = [table(0.3), lid(height(k), height(k + 1))];
        state = ball.advance_large(&mut large, &state, &bodies, weightless()).state;
    }
    let (flowed, shape) = (large.elements().plastic_strain_max(), large.displacement().to_vec());
    assert!(flowed > 0.01, "{flowed}");
    let mut torn = state.clone();
    torn.forces.iter_mut().for_each(|(_, force)| *force *= -1e6);
    let failed = ball.try_advance_large(&mut large, &torn, &[table(0.3)], weightless());
    assert!(failed.is_err());
    assert_eq!(large.elements().plastic_strain_max(), flowed);
    assert_eq!(large.displacement(), shape);
}
