//! Steps that go on with what another one carried, and steps that meet a body they were not near.

use nalgebra::{Isometry3, Vector3};

use super::tests::{Object, at, table};
use super::*;
use crate::mesh::BuiltIn;
use crate::rigid_body::RigidShape;

const SIZE: f64 = 0.07;
const TIP: f64 = 0.008;

/// A table, and two tips that have closed on a ball of 7 cm by a depth and lifted it.
fn table_and_tips(depth: [f64; 2], lifted: [f64; 2]) -> Vec<MovingBody> {
    let floor = Isometry3::translation(0.0, 0.0, -0.5 * SIZE);
    let mut bodies =
        vec![MovingBody { world_from_body_start: floor, world_from_body_end: floor, ..table(0.5) }];
    for side in [-1.0, 1.0] {
        let pose = |k: usize| at(side * (0.5 * SIZE + TIP + 0.001 - depth[k]), 0.0, lifted[k]);
        bodies.push(MovingBody {
            world_from_body_start: pose(0),
            world_from_body_end: pose(1),
            compliance: 1e-3,
            ..MovingBody::resting(RigidShape::sphere(TIP).unwrap(), pose(0), 0.8)
        });
    }
    bodies
}

#[test]
fn a_step_that_goes_on_is_the_one_made_anew_to_the_bit() {
    let ball = Object::sized(BuiltIn::Sphere, 400, SIZE, 5e4, 0.4);
    let settings = StepSettings { seconds: 1.0 / 60.0, viscosity: 0.02, ..StepSettings::default() };
    let share = |step: u32, from: u32| f64::from(step.clamp(from, from + 12) - from) / 12.0;
    let mut carried = Carried::default();
    let mut state = ObjectState::at_rest(Isometry3::identity());
    let mut lifted = 0.0;
    for step in 0..40 {
        let depth = [step, step + 1].map(|step| 0.006 * share(step, 0));
        let up = [step, step + 1].map(|step| 0.02 * share(step, 14));
        let bodies = table_and_tips(depth, up);
        let wanted = &ball.surface.nodes;
        let (anew, going_on) = ball.with_step(&state, &bodies, settings, |made| {
            let anew = made.advance(&state, wanted).unwrap();
            (anew, made.advance_from(&state, wanted, &mut carried).unwrap())
        });
        assert!(anew.is_converged, "step {step}");
        assert_eq!(anew, going_on, "step {step}");
        lifted = going_on.state.world_from_object.translation.z;
        state = going_on.state;
    }
    assert!(lifted > 0.015, "{lifted}");
}

#[test]
fn what_was_carried_from_another_state_is_not_gone_on_with() {
    let ball = Object::sized(BuiltIn::Sphere, 300, SIZE, 5e4, 0.4);
    let settings = StepSettings { viscosity: 0.02, ..StepSettings::default() };
    let pressed = table_and_tips([0.0, 0.003], [0.0; 2]);
    let begun = ObjectState::at_rest(Isometry3::identity());
    let mut carried = Carried::default();
    let wanted = &ball.surface.nodes;
    let mut step = |state: &ObjectState| {
        ball.with_step(state, &pressed, settings, |step| {
            step.advance_from(state, wanted, &mut carried).unwrap()
        })
    };
    let (first, again) = (step(&begun), step(&begun));
    assert_eq!(first.displacements, again.displacements);
    assert_eq!(first.state, again.state);
}

/// A tip pushes a ball by 4 mm in one step onto a table that is 2 mm away: farther than what the rounds look
/// at from the start.
#[test]
fn a_table_onto_which_the_object_is_pushed_in_one_step_is_met() {
    let ball = Object::sized(BuiltIn::Sphere, 300, SIZE, 5e4, 0.4);
    // Long enough that the ball's mass gives way more than its shape.
    let settings =
        StepSettings { seconds: 0.1, gravity: Vector3::zeros(), ..StepSettings::default() };
    let floor = Isometry3::translation(0.0, 0.0, -0.5 * SIZE - 0.002);
    let above = |depth: f64| at(0.0, 0.0, 0.5 * SIZE + 0.02 - depth);
    let bodies = [
        MovingBody { world_from_body_start: floor, world_from_body_end: floor, ..table(0.5) },
        MovingBody {
            world_from_body_end: above(0.004),
            ..MovingBody::resting(RigidShape::sphere(0.02).unwrap(), above(0.0), 0.5)
        },
    ];
    let found = ball.advance(&ObjectState::at_rest(Isometry3::identity()), &bodies, settings);
    assert!(found.is_converged);
    assert!(
        found.penetration_max <= 1e-6 * ball.model.mesh().size(),
        "{:e}",
        found.penetration_max
    );
    assert!(found.loads[0].normal_force > 0.1, "{:?}", found.loads[0]);
    assert!(found.loads[1].normal_force > found.loads[0].normal_force);
}
