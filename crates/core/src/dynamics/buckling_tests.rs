//! A column that buckles between two plates: the tangent of its shape is that of a body that would give way by
//! itself.

use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};

use super::tests::{Object, at, table};
use super::*;
use crate::fem::hyperelastic::Law;
use crate::mesh::samples::block;
use crate::rigid_body::RigidShape;

/// Width, height, m, and Young's modulus, Pa, of the column.
const WIDTH: f64 = 0.012;
const HEIGHT: f64 = 8.0 * WIDTH;
const YOUNG: f64 = 5.0e4;

/// A column on the ground, two cells wide.
fn column() -> Object {
    let mesh = block(2, 16);
    let aside = Vector3::new(0.5 * WIDTH, 0.5 * WIDTH, 0.0);
    let vertices = mesh.vertices().iter().map(|p| p * WIDTH - aside).collect();
    Object::new(mesh.with_vertices(vertices).unwrap(), YOUNG, 0.4)
}

/// A plate with its lower face at some height and some way aside at the beginning of a step and at its end.
fn plate(begin: (f64, f64), end: (f64, f64)) -> MovingBody {
    let half = Vector3::new(0.03, 0.03, 0.01);
    let pose = |(height, aside): (f64, f64)| {
        let place = Translation3::new(aside, 0.0, height + half.z);
        Isometry3::from_parts(place, UnitQuaternion::identity())
    };
    MovingBody {
        world_from_body_start: pose(begin),
        world_from_body_end: pose(end),
        ..MovingBody::resting(RigidShape::cuboid(half).unwrap(), pose(begin), 1.0)
    }
}

#[test]
fn column_pressed_until_it_buckles_is_followed_and_not_refused() {
    let column = column();
    let mut large = column.large(Law::NeoHookean);
    let mut state = ObjectState::at_rest(at(0.0, 0.0, 0.0));
    // Pressed by a sixth, and a little aside, which says where it is to go.
    let steps = 28;
    let way = |k: i32| {
        let share = f64::from(k) / f64::from(steps);
        (HEIGHT * (1.0 - share / 6.0), 5e-4 * share)
    };
    let settings = StepSettings { residual_rel: 1e-4, ..StepSettings::default() };
    let (mut forces, mut rotation) = (Vec::new(), 0.0f64);
    for k in 0..steps {
        let bodies = [table(1.0), plate(way(k), way(k + 1))];
        let made = column.try_advance_large(&mut large, &state, &bodies, settings);
        let found = made.unwrap_or_else(|error| panic!("step {k}: {error}"));
        assert!(found.contact_residual_rel.is_finite() && found.residual_rel.is_finite());
        forces.push(found.loads[1].normal_force);
        rotation = rotation.max(large.summary().rotation_max);
        state = found.state;
    }
    // The force rises until the column buckles; then it falls, and the column bends.
    let most = forces.iter().copied().fold(0.0, f64::max);
    let last = forces[forces.len() - 1];
    assert!(last < 0.5 * most, "the force falls: {most} N, then {last} N");
    assert!(rotation > 0.5, "it bends by {rotation} rad");
}
