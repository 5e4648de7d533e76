//! The small system of a step against steps that end a little elsewhere.

use nalgebra::{DMatrix, DVector, Isometry3, Vector3};

use super::tests::{Object, at, settled, table};
use super::*;
use crate::fem::hyperelastic::Law;
use crate::mesh::BuiltIn;
use crate::rigid_body::RigidShape;

/// A soft ball on a table between two fingers that stick to it.
fn pinched(moved: &[Vector3<f64>; 2], friction: f64) -> Vec<MovingBody> {
    let mut bodies = vec![table(0.25 * friction)];
    for (side, moved) in [-1.0, 1.0].iter().zip(moved) {
        let shape = RigidShape::sphere(0.008).unwrap();
        let begin = at(side * 0.0222, 0.0, 0.015);
        let mut end = at(side * 0.0218, 0.0, 0.015);
        end.translation.vector += moved;
        bodies.push(MovingBody {
            shape,
            world_from_body_start: begin,
            world_from_body_end: end,
            friction,
            compliance: 1e-3,
        });
    }
    bodies
}

fn settings() -> StepSettings {
    StepSettings {
        viscosity: 0.02,
        residual_rel: 1e-12,
        penetration_rel: 1e-10,
        rounds_max: 40,
        small_system: true,
        ..StepSettings::default()
    }
}

fn forces(outcome: &StepOutcome) -> DVector<f64> {
    let system = outcome.small_system.as_ref().unwrap();
    let forces = system.contacts.iter().flat_map(|contact| <[f64; 3]>::from(contact.force));
    DVector::from_iterator(3 * system.contacts.len(), forces)
}

/// Ways of the two fingers as those of all bodies.
fn ways(moved: &[Vector3<f64>; 2]) -> DVector<f64> {
    let all = [Vector3::zeros(), moved[0], moved[1]];
    DVector::from_iterator(9, all.into_iter().flat_map(<[f64; 3]>::from))
}

/// Both fingers close.
const PINCH: [Vector3<f64>; 2] = [Vector3::new(1.0, 0.0, 0.0), Vector3::new(-1.0, 0.0, 0.0)];
/// How far the forces of steps that end a little elsewhere are from what the small system says, over how
/// much they change.
fn errors(
    step: &mut dyn FnMut(&[MovingBody]) -> StepOutcome,
    friction: f64,
    way: &[Vector3<f64>; 2],
    sizes: [f64; 2],
) -> [f64; 2] {
    let about = step(&pinched(&[Vector3::zeros(); 2], friction));
    let system = about.small_system.clone().unwrap();
    assert_eq!(system.contacts.iter().map(|c| c.body).collect::<Vec<_>>(), [0, 1, 2]);
    let stiffness: DMatrix<f64> = system.compliance.clone().try_inverse().unwrap();
    sizes.map(|size| {
        let moved = way.map(|w| size * w);
        let there = step(&pinched(&moved, friction));
        let expected = &stiffness * ways(&moved);
        let changed = forces(&there) - forces(&about);
        (&changed - &expected).norm() / changed.norm()
    })
}

#[test]
fn forces_of_a_step_that_ends_a_little_elsewhere_follow_the_small_system() {
    let object = Object::sized(BuiltIn::Sphere, 500, 0.03, 20e3, 0.45);
    let state = ObjectState::at_rest(at(0.0, 0.0, 0.015));
    let (state, _) = settled(&object, state, 10);
    let mut step = |bodies: &[MovingBody]| object.advance(&state, bodies, settings());
    // What is left does not shrink with the way: the sides of a moving force, and normals that turn.
    let found = errors(&mut step, 4.0, &PINCH, [1e-5, 2.5e-6]);
    assert!(found.iter().all(|error| *error < 0.06), "{found:?}");
}

#[test]
fn the_tangent_at_large_deformation_is_that_of_its_step() {
    let object = Object::sized(BuiltIn::Sphere, 300, 0.03, 20e3, 0.45);
    let state = ObjectState::at_rest(at(0.0, 0.0, 0.015));
    let (state, _) = settled(&object, state, 10);
    let mut step = |bodies: &[MovingBody]| {
        let mut large = object.large(Law::NeoHookean);
        object.advance_large(&mut large, &state, bodies, settings())
    };
    let [far, near] = errors(&mut step, 4.0, &PINCH, [2e-5, 5e-6]);
    assert!(far < 0.01 && near < 0.01, "{near} {far}");
}

#[test]
fn a_small_system_is_made_where_it_is_asked_for_only() {
    let object = Object::sized(BuiltIn::Sphere, 200, 0.03, 20e3, 0.45);
    let state = ObjectState::at_rest(at(0.0, 0.0, 0.02));
    let quiet = StepSettings { small_system: false, ..settings() };
    let bodies = pinched(&[Vector3::zeros(); 2], 4.0);
    assert_eq!(object.advance(&state, &bodies, quiet).small_system, None);
    let far = [MovingBody::resting(RigidShape::sphere(0.01).unwrap(), at(1.0, 0.0, 0.0), 1.0)];
    let alone = object.advance(&state, &far, settings()).small_system.unwrap();
    assert!(alone.contacts.is_empty() && alone.compliance.is_empty());
}

/// The bodies in a world that is turned.
fn turned_bodies(bodies: &[MovingBody], turn: &Isometry3<f64>) -> Vec<MovingBody> {
    let turned = |body: &MovingBody| MovingBody {
        world_from_body_start: turn * body.world_from_body_start,
        world_from_body_end: turn * body.world_from_body_end,
        ..body.clone()
    };
    bodies.iter().map(turned).collect()
}

/// Friction of 4, and fingers a millimetre deep in an object that nothing has touched before.
#[test]
fn a_grip_that_begins_deep_is_solved_whichever_way_the_world_is_turned() {
    let object = Object::sized(BuiltIn::Sphere, 200, 0.03, 20e3, 0.45);
    let bodies = pinched(&[Vector3::zeros(); 2], 4.0);
    let weightless = StepSettings { gravity: Vector3::zeros(), ..settings() };
    let loads = |angle: f64| {
        let turn = Isometry3::rotation(angle * Vector3::new(0.4, -0.2, 0.9));
        let state = ObjectState::at_rest(turn * at(0.0, 0.0, 0.0145));
        let found = object.advance(&state, &turned_bodies(&bodies, &turn), weightless);
        assert!(found.is_converged, "turned by {angle}");
        found.loads.iter().map(|load| load.normal_force).collect::<Vec<f64>>()
    };
    let straight = loads(0.0);
    assert!(straight.iter().all(|force| *force > 0.1), "{straight:?}");
    for angle in 1..24 {
        for (force, expected) in loads(0.125 * f64::from(angle)).iter().zip(&straight) {
            assert!((force - expected).abs() < 1e-9 * expected, "turned by {angle} / 8: {force}");
        }
    }
}

#[test]
fn a_turned_world_turns_the_small_system() {
    let object = Object::sized(BuiltIn::Sphere, 200, 0.03, 20e3, 0.45);
    let turn = Isometry3::rotation(Vector3::new(0.4, -0.2, 0.9));
    let state = ObjectState::at_rest(at(0.0, 0.0, 0.0145));
    let turned_state = ObjectState::at_rest(turn * at(0.0, 0.0, 0.0145));
    let bodies = pinched(&[Vector3::zeros(); 2], 4.0);
    let weightless = StepSettings { gravity: Vector3::zeros(), ..settings() };
    let one = object.advance(&state, &bodies, weightless).small_system.unwrap();
    let other = object
        .advance(&turned_state, &turned_bodies(&bodies, &turn), weightless)
        .small_system
        .unwrap();
    assert_eq!(one.contacts.len(), other.contacts.len());
    let rotation = turn.rotation.to_rotation_matrix();
    for i in 0..one.contacts.len() {
        let force = rotation * one.contacts[i].force;
        assert!((force - other.contacts[i].force).norm() < 1e-6 * force.norm());
        for j in 0..one.contacts.len() {
            let block = one.compliance.fixed_view::<3, 3>(3 * i, 3 * j);
            let expected = rotation.matrix() * block * rotation.matrix().transpose();
            let found = other.compliance.fixed_view::<3, 3>(3 * i, 3 * j);
            assert!((expected - found).norm() < 1e-5 * one.compliance.norm(), "{expected} {found}");
        }
    }
}
