//! Laws that hold in every scene: uniform pressure passes a patch, a mirrored scene has mirrored answers,
//! forces and torques balance, and nothing creeps.
//! Partial slip of a rigid ball that is pressed into a block and then sheared: Cattaneo and Mindlin.

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
    for nodes in [64, 216, 729] {
        press_evenly(&Object::sized(BuiltIn::Cube, nodes, EDGE, YOUNG, 0.3));
    }
}

/// Edge of the block, m.
pub(super) const EDGE: f64 = 0.05;

/// Presses a block between two planes and compares force and field with the closed form.
pub(super) fn press_evenly(block: &Object) {
    let (depth, nodes) = (2e-6, block.surface.nodes.len());
    let half_turn = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI);
    let settings = StepSettings {
        gravity: Vector3::zeros(),
        penetration_rel: 1e-12,
        ..StepSettings::default()
    };
    let height = Translation3::new(0.0, 0.0, EDGE - depth);
    let lid = MovingBody {
        world_from_body_start: Isometry3::from_parts(height, half_turn),
        world_from_body_end: Isometry3::from_parts(height, half_turn),
        ..table(0.0)
    };
    let mut state = ObjectState::at_rest(at(0.0, 0.0, 0.5 * (EDGE - depth)));
    let mut found = None;
    for _ in 0..30 {
        let outcome = block.advance(&state, &[table(0.0), lid.clone()], settings);
        state = outcome.state.clone();
        found = Some(outcome);
    }
    let found = found.unwrap();
    let expected = YOUNG * EDGE * EDGE * depth / EDGE;
    let force = found.loads[1].normal_force;
    assert!((force - expected).abs() < 1e-6 * expected, "{nodes}: {force} N for {expected} N");
    // The surface: every height has gone down in proportion.
    for (&node, moved) in block.surface.nodes.iter().zip(&found.displacements) {
        let rest = block.model.mesh().vertices()[node as usize];
        let height = (state.world_from_object * (rest + Vector3::from(*moved))).z;
        let linear = (rest.z + 0.5 * EDGE) * (1.0 - depth / EDGE);
        assert!((height - linear).abs() < 1e-5 * depth, "{nodes}: {height} for {linear}");
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

pub(super) const YOUNG: f64 = 2.0e4;
const POISSON: f64 = 0.4;
/// Radius of the ball, m.
const RADIUS: f64 = 0.02;
/// Radius of the contact that the meshes are made for, m.
const CONTACT: f64 = 0.003;
/// Half the width and the height of the block, m: it must be large against the contact.
const REACH: f64 = 6.0 * CONTACT;
/// How much finer the mesh is below the ball than far from it: the spacing grows like cosh.
const GRADING: f64 = 3.0;
const FRICTION: f64 = 0.3;

/// A block on the table whose mesh is fine below the middle of its top, which is at the height 0.
fn block(nodes_per_edge: usize) -> Object {
    let mesh = generate(BuiltIn::Cube, nodes_per_edge.pow(3)).unwrap();
    let (low, high) = mesh.bounds();
    let graded = |share: f64| REACH * (GRADING * share).sinh() / GRADING.sinh();
    let share = |p: &Point3<f64>, axis: usize| (p[axis] - low[axis]) / (high[axis] - low[axis]);
    let vertices = mesh.vertices().iter().map(|p| {
        let across = |axis| graded(2.0 * share(p, axis) - 1.0);
        Point3::new(across(0), across(1), -graded(1.0 - share(p, 2)))
    });
    Object::new(mesh.with_vertices(vertices.collect()).unwrap(), YOUNG, POISSON)
}

/// What the ball meets at one place of its way.
struct Sheared {
    /// Way along the surface, m.
    way: f64,
    /// Force against it, N.
    force: f64,
    /// Normal force, N.
    normal: f64,
    /// Largest distance from the middle of the contact of a point that sticks, m.
    sticks_to: f64,
}

impl Sheared {
    /// Share of what friction allows.
    fn share(&self) -> f64 {
        self.force / (FRICTION * self.normal)
    }

    /// Radius of the contact from the normal force (Hertz), m.
    fn radius(&self) -> f64 {
        let reduced = YOUNG / (1.0 - POISSON * POISSON);
        (3.0 * self.normal * RADIUS / (4.0 * reduced)).cbrt()
    }
}

/// Presses the ball into the block without friction, and then moves it along the surface.
fn sheared(block: &Object, ways: &[f64]) -> Vec<Sheared> {
    // So heavy that nothing needs to hold it.
    let settings = StepSettings {
        gravity: Vector3::zeros(),
        density: 1e15,
        residual_rel: 1e-6,
        rounds_max: 40,
        newton_max: 1000,
        ..StepSettings::default()
    };
    let depth = CONTACT * CONTACT / RADIUS;
    let place = |way: f64, depth: f64| {
        let place = Translation3::new(way, 0.0, RADIUS - depth);
        Isometry3::from_parts(place, UnitQuaternion::identity())
    };
    let mut state = ObjectState::at_rest(Isometry3::identity());
    let mut from = place(0.0, 0.0);
    let presses = (1..=6).map(|k| (0.0, depth * f64::min(f64::from(k) / 4.0, 1.0), 0.0));
    let mut made = Vec::new();
    for (way, depth, friction) in presses.chain(ways.iter().map(|way| (*way, depth, FRICTION))) {
        let to = place(way, depth);
        let ball = MovingBody {
            world_from_body_start: from,
            world_from_body_end: to,
            ..MovingBody::resting(RigidShape::sphere(RADIUS).unwrap(), to, friction)
        };
        let found = block.advance(&state, &[ball], settings);
        let rel = found.contact_residual_rel;
        assert!(rel < 2e-3, "way {way} m: {rel:e}");
        // Nearly all that friction allows is what slips, within the residual.
        let sticks = |c: &&PointContact| {
            let normal = c.force.dot(&c.normal);
            (c.force - normal * c.normal).norm() < 0.995 * friction * normal
        };
        let sticking = found.contacts.iter().filter(sticks);
        let distance = |c: &PointContact| (c.place.x - way).hypot(c.place.y);
        let load = found.loads[0].force;
        made.push(Sheared {
            way,
            force: load.x,
            normal: -load.z,
            sticks_to: sticking.map(distance).fold(0.0, f64::max),
        });
        (state, from) = (found.state, to);
    }
    made.split_off(6)
}

/// Largest parts of the way that a law leaves, over the way: Mindlin's, and one of a contact that does
/// not slip. The far parts of the block, which is no half space, give way in proportion to the force;
/// how much is taken from the ways themselves (least squares).
fn left_of_the_way(made: &[Sheared]) -> (f64, f64) {
    let shear = YOUNG / (2.0 * (1.0 + POISSON)) / (2.0 - POISSON);
    let left = |local: &dyn Fn(&Sheared) -> f64| {
        let over = |of: &dyn Fn(&Sheared) -> f64| made.iter().map(of).sum::<f64>();
        let give = over(&|at| (at.way - local(at)) * at.force) / over(&|at| at.force.powi(2));
        let off = made.iter().map(|at| (at.way - local(at) - give * at.force).abs());
        off.fold(0.0, f64::max) / made.last().unwrap().way
    };
    let mindlin = |at: &Sheared| {
        let whole = 3.0 * FRICTION * at.normal / (16.0 * at.radius() * shear);
        whole * (1.0 - (1.0 - at.share()).powf(2.0 / 3.0))
    };
    (left(&mindlin), left(&|_| 0.0))
}

/// Partial slip: `way = 3 μ N / (16 a G*) (1 − (1 − T/μN)^(2/3))` with 1/G* = (2 − ν)/G, and what sticks
/// lies within the radius `a (1 − T/μN)^(1/3)`.
///
/// Source: Cattaneo (1938), Mindlin (1949); for example Johnson, Contact Mechanics (1985), 7.2.
#[test]
fn sheared_ball_slips_from_the_edge_as_cattaneo_and_mindlin_say_on_finer_and_finer_meshes() {
    let ways: Vec<f64> = (1..=16).map(|k| 1.0e-5 * f64::from(k)).collect();
    let mut worst = Vec::new();
    for (nodes, allowed) in [(13, 0.07), (19, 0.025)] {
        let mut made = sheared(&block(nodes), &ways);
        made.retain(|at| at.share() < 0.95);
        assert!(made.len() > 8, "it slips after {} steps", made.len());
        for at in &made {
            let stick = (1.0 - at.share()).cbrt() * at.radius();
            // Spacing of the nodes below the ball.
            let spacing = 2.0 * REACH * GRADING / GRADING.sinh() / (nodes - 1) as f64;
            let to = at.sticks_to;
            assert!(to < stick + spacing, "{nodes}: sticks to {to} m, should to {stick} m");
        }
        let (mindlin, without_slip) = left_of_the_way(&made);
        assert!(mindlin < allowed, "{nodes} nodes along an edge: off by {mindlin}");
        worst.push((mindlin, without_slip));
    }
    assert!(worst[1].0 < 0.5 * worst[0].0, "no better on a finer mesh: {worst:?}");
    assert!(worst[1].1 > 3.0 * worst[1].0, "a law without slip does as well: {worst:?}");
}
