//! Contact at large deformation: laws in closed form, linear elasticity where loads are small, turned
//! scenes, weight, equal bits, and residuals that are worked out once more.

use nalgebra::{DMatrix, DVector, Isometry3, Translation3, UnitQuaternion, Vector3};

use super::tests::{Object, at, table};
use super::*;
use crate::fem::hyperelastic::Law;
use crate::mesh::BuiltIn;
use crate::rigid_body::RigidShape;

fn weightless() -> StepSettings {
    StepSettings { gravity: Vector3::zeros(), ..StepSettings::default() }
}

/// A plane that faces down, at a height at the beginning of a step and at its end.
fn lid(from: f64, to: f64, friction: f64) -> MovingBody {
    let half_turn = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI);
    let pose = |z: f64| Isometry3::from_parts(Translation3::new(0.0, 0.0, z), half_turn);
    MovingBody {
        world_from_body_start: pose(from),
        world_from_body_end: pose(to),
        ..table(friction)
    }
}

/// Nominal stress of a bar that is pressed to a stretch and free at its sides, over Young's modulus.
///
/// Source: energy μ/2 (tr FᵀF − 3) − μ ln J + λ/2 ln² J.
fn pressed(stretch: f64, poisson: f64) -> f64 {
    let mu = 0.5 / (1.0 + poisson);
    let lambda = poisson / ((1.0 + poisson) * (1.0 - 2.0 * poisson));
    let nominal = |own: f64, j: f64| mu * (own - 1.0 / own) + lambda * j.ln() / own;
    let (mut low, mut high) = (1.0, 2.0);
    for _ in 0..100 {
        let side: f64 = 0.5 * (low + high);
        match nominal(side, stretch * side * side) > 0.0 {
            true => high = side,
            false => low = side,
        }
    }
    nominal(stretch, stretch * low * low)
}

#[test]
fn block_between_planes_pressed_by_a_third_has_the_force_of_the_law() {
    assert!((pressed(0.84, 0.3) + 0.184190).abs() < 1e-6);
    let (young, edge) = (2.0e4, 0.05);
    let block = Object::sized(BuiltIn::Cube, 125, edge, young, 0.3);
    let mut large = block.large(Law::NeoHookeanLog);
    let mut state = ObjectState::at_rest(at(0.0, 0.0, 0.5 * edge));
    let steps = 10;
    let height = |k: i32| edge * (1.0 - 0.3 * f64::from(k.min(steps)) / f64::from(steps));
    for k in 0..steps + 20 {
        let bodies = [table(0.0), lid(height(k), height(k + 1), 0.0)];
        let found = block.advance_large(&mut large, &state, &bodies, weightless());
        state = found.state.clone();
        if k == steps + 19 {
            let expected = -young * edge * edge * pressed(0.7, 0.3);
            let force = found.loads[1].normal_force;
            assert!((force - expected).abs() < 1e-6 * expected, "{force} N for {expected} N");
            assert!(found.is_converged);
        }
    }
}

/// Presses a ball between two planes by some depth at each pole; the force, linear or large.
fn ball_pressed(depth: f64, is_large: bool) -> f64 {
    let ball = Object::sized(BuiltIn::Sphere, 300, 0.06, 2.0e4, 0.4);
    let (low, high) = ball.model.mesh().bounds();
    let height = high.z - low.z - 2.0 * depth;
    let bodies = [table(0.0), lid(height, height, 0.0)];
    let mut large = ball.large(Law::NeoHookean);
    let mut state = ObjectState::at_rest(at(0.0, 0.0, -low.z - depth));
    let mut force = 0.0;
    for _ in 0..12 {
        let found = match is_large {
            true => ball.advance_large(&mut large, &state, &bodies, weightless()),
            false => ball.advance(&state, &bodies, weightless()),
        };
        assert!(found.is_converged, "{depth} m");
        (force, state) = (found.loads[1].normal_force, found.state);
    }
    force
}

#[test]
fn small_presses_of_a_ball_are_those_of_linear_elasticity_to_the_next_order() {
    let off = |depth: f64| ball_pressed(depth, true) / ball_pressed(depth, false) - 1.0;
    let (small, twice) = (off(1e-4), off(2e-4));
    assert!(small.abs() < 0.02, "{small}");
    assert!((twice / small - 2.0).abs() < 0.3, "{twice} {small}");
}

#[test]
fn weight_of_a_soft_cube_on_a_table_is_what_the_table_feels() {
    let cube = Object::sized(BuiltIn::Cube, 125, 0.05, 3.0e3, 0.4);
    let mut large = cube.large(Law::NeoHookean);
    let settings = StepSettings { viscosity: 0.02, ..StepSettings::default() };
    let mut state = ObjectState::at_rest(at(0.0, 0.0, 0.03));
    let mut found = None;
    for _ in 0..300 {
        let outcome = cube.advance_large(&mut large, &state, &[table(0.5)], settings);
        state = outcome.state.clone();
        found = Some(outcome);
    }
    let (found, weight) = (found.unwrap(), 9.81 * cube.mass());
    let force = found.loads[0].force;
    assert!(large.summary().strain_max > 0.05, "{:?}", large.summary());
    assert!((force.z - weight).abs() < 1e-9 * weight, "{force} {weight}");
    assert!(force.xy().norm() < 1e-9 * weight);
    assert!(found.is_converged && found.penetration_max < 1e-6 * 0.05);
}

/// A finger that goes into the side of a ball on a table and up, in a world that is turned.
fn pushed(turn: UnitQuaternion<f64>) -> Vec<StepOutcome> {
    let ball = Object::sized(BuiltIn::Sphere, 200, 0.06, 5.0e3, 0.4);
    let (low, _) = ball.model.mesh().bounds();
    let mut large = ball.large(Law::NeoHookean);
    let settings = StepSettings {
        gravity: turn * StepSettings::default().gravity,
        viscosity: 0.01,
        residual_rel: 1e-10,
        ..StepSettings::default()
    };
    let mut state = ObjectState::at_rest(turn * at(0.0, 0.0, -low.z));
    let pose = |k: i32| {
        let k = f64::from(k);
        turn * at(-0.037 + 0.001 * k, 0.002, 0.036 + 0.0003 * k)
    };
    let mut made = Vec::new();
    for k in 0..14 {
        let tip = MovingBody {
            world_from_body_start: pose(k),
            world_from_body_end: pose(k + 1),
            ..MovingBody::resting(RigidShape::sphere(0.008).unwrap(), pose(0), 0.6)
        };
        let floor = MovingBody {
            world_from_body_start: turn * at(0.0, 0.0, 0.0),
            world_from_body_end: turn * at(0.0, 0.0, 0.0),
            ..table(0.6)
        };
        let found = ball.advance_large(&mut large, &state, &[floor, tip], settings);
        state = found.state.clone();
        made.push(found);
    }
    made
}

#[test]
fn turned_scene_has_turned_answers() {
    let turn = UnitQuaternion::from_euler_angles(0.7, -1.1, 2.3);
    let (here, there) = (pushed(UnitQuaternion::identity()), pushed(turn));
    let most = here.iter().map(|o| o.loads[1].force.norm()).fold(0.0, f64::max);
    assert!(most > 0.05, "the finger never pressed: {most} N");
    for (step, (a, b)) in here.iter().zip(&there).enumerate() {
        for (load, turned) in a.loads.iter().zip(&b.loads) {
            let off = (turn * load.force - turned.force).norm();
            assert!(off < 1e-6 * most, "step {step}: {off:e} N of {most} N");
        }
        let place = |o: &StepOutcome| o.state.world_from_object.translation.vector;
        let off = (turn * place(a) - place(b)).norm();
        assert!(off < 1e-8, "step {step}: {off:e} m");
    }
}

#[test]
fn steps_have_the_same_bits_for_any_number_of_threads() {
    let bits = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| format!("{:?}", pushed(UnitQuaternion::identity())))
    };
    let one = bits(1);
    assert!(one == bits(2) && one == bits(3));
}

/// What a step is off by, worked out from the answer alone: forces out of balance over the contact
/// forces, and the deepest node, m.
fn off_by(
    object: &Object,
    law: Law,
    large: &LargeBody,
    found: &StepOutcome,
    bodies: &[MovingBody],
) -> (f64, f64) {
    let world_from_object = found.state.world_from_object;
    let turn = world_from_object.rotation;
    let u = large.displacement();
    let mut forces = vec![0.0; u.len()];
    for contact in &found.contacts {
        let force = turn.inverse() * contact.force;
        for (&node, weight) in contact.nodes.iter().zip(contact.weights) {
            (0..3).for_each(|axis| forces[3 * node as usize + axis] += weight * force[axis]);
        }
    }
    let size = DVector::from_vec(forces.clone()).norm();
    let holding = object.model.hyperelastic(law).unwrap().evaluate(u).forces;
    let left = DVector::from_iterator(u.len(), forces.iter().zip(&holding).map(|(f, h)| f - h));
    // Any acceleration of the rigid body may balance what is left.
    let loads: Vec<DVector<f64>> =
        object.body.mean_loads().into_iter().map(DVector::from_vec).collect();
    let loads = DMatrix::from_columns(&loads);
    let best = loads.clone().svd(true, true).solve(&left, 1e-14).unwrap();
    let residual = (&left - loads * best).norm();
    let rest = object.model.mesh().vertices();
    let mut depth: f64 = 0.0;
    for &node in &object.surface.nodes {
        let at = 3 * node as usize;
        let place =
            world_from_object * (rest[node as usize] + Vector3::from_row_slice(&u[at..at + 3]));
        for body in bodies {
            let in_body = body.world_from_body_end.inverse_transform_point(&place);
            depth = depth.max(-body.shape.distance(&in_body).distance);
        }
    }
    (if size > 0.0 { residual / size } else { residual }, depth)
}

/// Numbers without a pattern (splitmix64).
struct Random(u64);

impl Random {
    /// From 0 to 1.
    fn share(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut x = self.0;
        x = (x ^ (x >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        x = (x ^ (x >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        (x ^ (x >> 31)) as f64 / u64::MAX as f64
    }

    fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.share()
    }

    /// Below a number.
    fn below(&mut self, end: usize) -> usize {
        ((self.share() * end as f64) as usize).min(end - 1)
    }
}

/// A random object among a table and fingers that come from random sides.
fn random_press(seed: u64) -> (usize, usize) {
    let mut random = Random(seed);
    let shape = [BuiltIn::Sphere, BuiltIn::Cube, BuiltIn::Strawberry][random.below(3)];
    let law = [Law::NeoHookean, Law::NeoHookeanLog][random.below(2)];
    let poisson = random.between(0.2, 0.45);
    let object = Object::sized(shape, 80 + random.below(170), 0.06, 1.0e4, poisson);
    let mut large = object.large(law);
    let (low, _) = object.model.mesh().bounds();
    let friction = random.share();
    let radius = random.between(0.006, 0.012);
    let ways: Vec<(Vector3<f64>, f64)> = (0..1 + random.below(3))
        .map(|_| {
            let around = random.between(0.0, std::f64::consts::TAU);
            let side = Vector3::new(around.cos(), around.sin(), random.between(-0.2, 0.8));
            (side.normalize(), random.between(0.0003, 0.0012))
        })
        .collect();
    let settings = StepSettings { residual_rel: 1e-8, ..StepSettings::default() };
    let mut state = ObjectState::at_rest(at(0.0, 0.0, -low.z));
    let (steps, mut met) = (12, 0);
    for k in 0..steps {
        let finger = |(side, speed): &(Vector3<f64>, f64)| {
            let place = |k: f64| {
                let away = 0.5 * object.model.mesh().size() + radius - speed * k;
                let place = Vector3::new(0.0, 0.0, -low.z) + away * side;
                at(place.x, place.y, place.z)
            };
            MovingBody {
                world_from_body_start: place(f64::from(k)),
                world_from_body_end: place(f64::from(k + 1)),
                ..MovingBody::resting(RigidShape::sphere(radius).unwrap(), place(0.0), friction)
            }
        };
        let bodies: Vec<MovingBody> =
            std::iter::once(table(friction)).chain(ways.iter().map(finger)).collect();
        let found = object.advance_large(&mut large, &state, &bodies, settings);
        let (residual, depth) = off_by(&object, law, &large, &found, &bodies);
        let told = found.residual_rel;
        let what = format!("seed {seed}, step {k}");
        assert!(residual <= 1.001 * told + 1e-11, "{what}: off by {residual:e}, told {told:e}");
        let told = found.penetration_max;
        assert!(depth <= told + 1e-12, "{what}: {depth:e} m deep, told {told:e} m");
        if found.is_converged {
            met += 1;
            assert!(residual <= 1.1e-8 && found.contact_residual_rel <= 1.1e-8, "{what}");
        }
        for contact in &found.contacts {
            let normal = contact.force.dot(&contact.normal);
            let along = (contact.force - normal * contact.normal).norm();
            let outside = (along - friction * normal).max(-normal);
            assert!(outside <= found.cone_violation + 1e-12, "{what}: {outside:e} N outside");
        }
        state = found.state.clone();
    }
    (met, steps as usize)
}

#[test]
fn random_presses_are_no_further_off_than_they_say() {
    let made: Vec<(usize, usize)> = (0..8).map(random_press).collect();
    let (met, steps) = made.iter().fold((0, 0), |sum, of| (sum.0 + of.0, sum.1 + of.1));
    assert!(10 * met >= 8 * steps, "{met} of {steps} steps meet what was asked for");
}
