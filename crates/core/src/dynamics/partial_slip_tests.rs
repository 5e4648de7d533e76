//! Partial slip of a rigid ball that is pressed into a block and then sheared: Cattaneo and Mindlin.

use nalgebra::{Isometry3, Point3, Translation3, UnitQuaternion, Vector3};

use super::tests::Object;
use super::*;
use crate::mesh::{BuiltIn, generate};
use crate::rigid_body::RigidShape;

const YOUNG: f64 = 2.0e4;
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
