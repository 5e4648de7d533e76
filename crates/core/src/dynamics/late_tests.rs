//! Steps that are ended before they have met what was asked for: they say so, and what is missing.

use std::sync::atomic::{AtomicUsize, Ordering};

use nalgebra::Vector3;

use super::tests::{Object, at, table};
use super::*;
use crate::fem::hyperelastic::Law;
use crate::mesh::BuiltIn;
use crate::rigid_body::RigidShape;

/// A ball on a table.
fn ball() -> Object {
    Object::sized(BuiltIn::Sphere, 300, 0.07, 2.0e4, 0.4)
}

/// A finger that comes down on the ball by some millimetres in the step, beside the table.
fn pressed(depth: f64) -> [MovingBody; 2] {
    let radius = 0.012;
    let finger = |depth: f64| at(0.004, 0.0, 0.07 + radius - depth);
    let tip = MovingBody {
        world_from_body_start: finger(0.0),
        world_from_body_end: finger(depth),
        ..MovingBody::resting(RigidShape::sphere(radius).unwrap(), finger(0.0), 0.7)
    };
    [table(0.6), tip]
}

fn settings() -> StepSettings {
    StepSettings {
        residual_rel: 1e-8,
        gravity: Vector3::new(0.3, 0.0, -9.81),
        ..Default::default()
    }
}

/// The step, late from a number of looks on; the number of times that was looked.
fn ended_after(
    looks: usize,
    make: &mut dyn FnMut(&(dyn Fn() -> bool + Sync)) -> StepOutcome,
) -> (StepOutcome, usize) {
    let looked = AtomicUsize::new(0);
    let is_late = || looked.fetch_add(1, Ordering::Relaxed) >= looks;
    let outcome = make(&is_late);
    (outcome, looked.into_inner())
}

/// Ends a step after 0, 1, 2, … looks: all are answered, those that end early say so, and the more time there
/// is the nearer the end.
fn check(make: &mut dyn FnMut(&(dyn Fn() -> bool + Sync)) -> StepOutcome) {
    let (whole, all) = ended_after(usize::MAX, make);
    assert!(whole.is_converged && !whole.is_late);
    assert!(all > 4, "a step that is looked at {all} times");
    let (again, _) = ended_after(all, make);
    assert_eq!(again, whole, "time enough is all the time");
    let mut late = 0;
    for looks in 0..all {
        let (some, _) = ended_after(looks, make);
        assert_ne!(some.is_converged, some.is_late, "after {looks} looks: {some:?}");
        late += usize::from(some.is_late);
        let numbers = some.displacements.as_flattened().iter().copied();
        let numbers = numbers.chain([some.contact_residual, some.penetration_max]);
        assert!(numbers.chain(some.state.velocity.iter().copied()).all(f64::is_finite));
        // What is told is what is missing: far from the whole step's end nothing small is told.
        let off = some.loads.iter().zip(&whole.loads).map(|(a, b)| (a.force - b.force).norm());
        let off = off.fold(0.0, f64::max) / whole.loads[1].force.norm();
        let told = some.contact_residual_rel.max(some.residual_rel);
        let depth = some.penetration_max / 0.07;
        assert!(off < 1e-4 || told > 1e-8 || depth > 1e-6, "after {looks} looks: off by {off}");
    }
    assert!(late > 0);
    let (none, _) = ended_after(0, make);
    assert!(none.is_late && none.contact_residual_rel.max(none.penetration_max / 0.07) > 1e-3);
}

#[test]
fn linear_step_ended_at_any_moment_says_so_and_what_is_missing() {
    let (ball, bodies) = (ball(), pressed(0.006));
    let state = ObjectState::at_rest(at(0.0, 0.0, 0.035));
    check(&mut |is_late| {
        ball.with_step(&state, &bodies, settings(), |step| {
            let step = ContactStep { is_late, ..step };
            step.advance(&state, &ball.surface.nodes).unwrap()
        })
    });
}

#[test]
fn large_step_ended_at_any_moment_says_so_and_what_is_missing() {
    let (ball, bodies) = (ball(), pressed(0.004));
    let state = ObjectState::at_rest(at(0.0, 0.0, 0.035));
    check(&mut |is_late| {
        let mut large = ball.large(Law::NeoHookean);
        ball.with_step(&state, &bodies, settings(), |step| {
            let step = ContactStep { is_late, ..step };
            LargeStep { step, body: &mut large }.advance(&state, &ball.surface.nodes).unwrap()
        })
    });
}

/// Of a step that is lost, halves are tried. One that ends before they do may have missed a better end.
#[test]
fn large_step_whose_halves_are_cut_short_says_that_it_is_late() {
    let (ball, mut bodies) = (ball(), pressed(0.003));
    let mut touching = ball.large(Law::NeoHookean);
    let state = ObjectState::at_rest(at(0.0, 0.0, 0.035));
    let begun = ball.try_advance_large(&mut touching, &state, &bodies, settings()).unwrap();
    let state = begun.state;
    bodies[1] = MovingBody {
        world_from_body_start: bodies[1].world_from_body_end,
        world_from_body_end: pressed(0.008)[1].world_from_body_end,
        ..bodies[1].clone()
    };
    // Without a round the forces stay as they are.
    let settings = StepSettings { rounds_max: 0, ..settings() };
    let mut make = |is_late: &(dyn Fn() -> bool + Sync)| {
        let mut large = ball.large(Law::NeoHookean);
        ball.with_step(&state, &bodies, settings, |step| {
            let step = ContactStep { is_late, ..step };
            LargeStep { step, body: &mut large }.advance(&state, &ball.surface.nodes).unwrap()
        })
    };
    let (whole, all) = ended_after(usize::MAX, &mut make);
    assert!(!whole.is_converged && !whole.is_late, "{whole:?}");
    let mut cut_short = 0;
    for looks in (0..all).step_by(1 + all / 40) {
        let (some, looked) = ended_after(looks, &mut make);
        assert!(looked > looks, "it was looked at {looked} times");
        cut_short += usize::from(looked < all);
        assert!(looked == all || some.is_late, "after {looks} looks of {all}: {looked}");
    }
    assert!(cut_short > 10, "{cut_short}");
}
