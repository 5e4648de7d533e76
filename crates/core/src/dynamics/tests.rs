//! Scenes with known answers: weight on a table, a pinch that lifts or slides, Hertz.

use nalgebra::{Isometry3, Point3, Translation3, UnitQuaternion, Vector3};

use super::*;
use crate::fem::{Element, Material};
use crate::mesh::{BuiltIn, Surface, TetMesh, generate};
use crate::model::Model;
use crate::rigid_body::RigidShape;
use crate::solve::condensed::{Base, Columns, Elasticity, FreeBody};

/// A soft object with all that a step needs.
struct Object {
    model: Model,
    surface: Surface,
    base: Base,
    body: FreeBody,
    columns: Columns,
}

impl Object {
    fn new(mesh: TetMesh, young: f64, poisson: f64) -> Self {
        let surface = Surface::from_mesh(&mesh);
        let material = Material::try_new(young, poisson).unwrap();
        let model = Model::try_new(mesh, Element::Tet4, &[material], vec![], &mut |_| {}).unwrap();
        let base = model.condense(&mut |_| {}).unwrap();
        let body = FreeBody::try_new(model.mesh(), &base).unwrap();
        Self { model, surface, base, body, columns: Columns::new(usize::MAX) }
    }

    /// A built-in object scaled to a size.
    fn sized(shape: BuiltIn, nodes: usize, size: f64, young: f64, poisson: f64) -> Self {
        let mesh = generate(shape, nodes).unwrap();
        let (low, high) = mesh.bounds();
        let scale = size / (high - low).max();
        let middle = nalgebra::center(&low, &high);
        let vertices = mesh.vertices().iter().map(|p| Point3::from((p - middle) * scale)).collect();
        Self::new(mesh.with_vertices(vertices).unwrap(), young, poisson)
    }

    fn advance(
        &self,
        state: &ObjectState,
        bodies: &[MovingBody],
        settings: StepSettings,
    ) -> StepOutcome {
        let vertices = self.model.mesh().vertices();
        let elasticity =
            Elasticity { base: &self.base, body: &self.body, columns: &self.columns };
        let size = self.model.mesh().size();
        let candidates = near_triangles(
            vertices,
            &self.surface.triangles,
            &state.world_from_object,
            bodies,
            0.3 * size,
        );
        let step = ContactStep {
            vertices,
            triangles: &self.surface.triangles,
            elasticity,
            bodies,
            candidates: &candidates,
            settings,
        };
        step.advance(state, &self.surface.nodes).unwrap()
    }

    /// Mass at a density of 1000 kg/m³.
    fn mass(&self) -> f64 {
        1000.0 * self.body.volume()
    }
}

fn table(friction: f64) -> MovingBody {
    MovingBody::resting(RigidShape::plane(Vector3::z()).unwrap(), Isometry3::identity(), friction)
}

fn at(x: f64, y: f64, z: f64) -> Isometry3<f64> {
    Isometry3::from_parts(Translation3::new(x, y, z), UnitQuaternion::identity())
}

#[test]
fn ball_falls_on_a_table_and_lies_there_with_its_weight() {
    let ball = Object::sized(BuiltIn::Sphere, 300, 0.06, 2.0e4, 0.4);
    let mut state = ObjectState::at_rest(at(0.0, 0.0, 0.035));
    let settings = StepSettings { viscosity: 0.01, ..StepSettings::default() };
    let mut last = None;
    for step in 0..200 {
        let found = ball.advance(&state, &[table(0.5)], settings);
        assert!(found.is_converged, "step {step}: {found:?}");
        state = found.state.clone();
        last = Some(found);
    }
    let found = last.unwrap();
    let weight = 9.81 * ball.mass();
    let force = found.loads[0].force;
    println!("{} rounds {} sweeps {} newton; {} contacts", found.rounds, found.sweeps, found.newton_steps, found.contacts.len());
    assert!((force.z - weight).abs() < 1e-9 * weight, "{force} {weight}");
    assert!(force.xy().norm() < 1e-9 * weight);
    assert!(state.velocity.norm() < 1e-9, "{}", state.velocity);
    assert!(found.penetration_max < 1e-7 * 0.06);
}

/// Pinches a ball from both sides, lifts it, and holds it; its height over time.
fn lift(depth: f64, friction: f64) -> (Vec<f64>, f64, Vec<StepOutcome>) {
    let ball = Object::sized(BuiltIn::Sphere, 1000, 0.06, 2.0e4, 0.4);
    let tip = RigidShape::sphere(0.008).unwrap();
    let h = 0.01;
    // Seconds: 0.3 to settle, 0.3 to close, 0.5 to lift by 3 cm, 1 to hold.
    let pose = |side: f64, t: f64| {
        let closed = ((t - 0.3) / 0.3).clamp(0.0, 1.0);
        let lifted = ((t - 0.6) / 0.5).clamp(0.0, 1.0);
        at(side * (0.04 - closed * (0.002 + depth)), 0.0, 0.03 + 0.03 * lifted)
    };
    let mut state = ObjectState::at_rest(at(0.0, 0.0, 0.03));
    let settings = StepSettings { viscosity: 0.005, ..StepSettings::default() };
    let (mut heights, mut outcomes) = (Vec::new(), Vec::new());
    for step in 0..210 {
        let (from, to) = (f64::from(step) * h, f64::from(step + 1) * h);
        let finger = |side: f64| MovingBody {
            shape: tip.clone(),
            world_from_body_start: pose(side, from),
            world_from_body_end: pose(side, to),
            friction,
        };
        let found = ball.advance(&state, &[table(friction), finger(-1.0), finger(1.0)], settings);
        state = found.state.clone();
        heights.push(state.world_from_object.translation.z);
        outcomes.push(found);
    }
    (heights, 9.81 * ball.mass(), outcomes)
}

#[test]
fn a_firm_pinch_lifts_the_ball_and_holds_it_still() {
    let (heights, weight, outcomes) = lift(0.007, 1.0);
    let last = outcomes.last().unwrap();
    let worst = outcomes.iter().map(|o| o.rounds).max();
    let all: usize = outcomes.iter().map(|o| usize::from(!o.is_converged)).sum();
    println!("rounds at most {worst:?}, {all} not converged, normal {:?}", last.loads[1].normal_force);
    for (i, o) in outcomes.iter().enumerate().step_by(10) {
        println!("{i} h {:.6} rounds {} sweeps {} newton {} contacts {} pen {:.1e} res {:.1e} conv {}", heights[i], o.rounds, o.sweeps, o.newton_steps, o.contacts.len(), o.penetration_max, o.contact_residual_rel, o.is_converged);
    }
    let held = last.loads[1].force.z + last.loads[2].force.z;
    assert!((held - weight).abs() < 1e-6 * weight, "{held} of {weight}");
    assert_eq!(last.loads[0].contacts, 0, "it still lies on the table");
    let end = heights.len() - 1;
    let drift = (heights[end] - heights[end - 80]).abs();
    assert!(drift < 1e-7, "{drift:e}");
    assert!(all == 0);
}

#[test]
fn a_weak_pinch_slides_off_and_the_ball_stays_on_the_table() {
    let (heights, weight, outcomes) = lift(0.003, 0.3);
    let last = outcomes.last().unwrap();
    assert!(heights.last().unwrap() < &0.031, "{heights:?}");
    assert!((last.loads[0].force.z - weight).abs() < 1e-6 * weight);
}
