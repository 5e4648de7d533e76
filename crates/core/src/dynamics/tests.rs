//! Scenes with known answers: weight on a table, a pinch that lifts or slides, Hertz.

use std::sync::Arc;

use nalgebra::{Isometry3, Point3, Translation3, UnitQuaternion, Vector3};

use super::*;
use crate::fem::hyperelastic::Law;
use crate::fem::{Element, Material, QuadraticMesh};
use crate::mesh::{BuiltIn, Surface, TetMesh, generate};
use crate::model::Model;
use crate::rigid_body::RigidShape;
use crate::solve::condensed::{Base, Columns, Elasticity, FreeBody};

/// A soft object with all that a step needs.
pub(super) struct Object {
    pub(super) model: Model,
    pub(super) surface: Surface,
    pub(super) base: Base,
    pub(super) body: FreeBody,
    columns: Columns,
}

impl Object {
    /// Of four-node elements; of ten-node ones where the mesh has mid-edge nodes.
    pub(super) fn new(mesh: TetMesh, young: f64, poisson: f64) -> Self {
        let surface = Surface::with_mid_edge_nodes(&mesh);
        let element = match mesh.mid_edge_nodes().is_empty() {
            true => Element::Tet4,
            false => Element::Tet10,
        };
        let material = Material::try_new(young, poisson).unwrap();
        let model = Model::try_new(mesh, element, &[material], vec![], &mut |_| {}).unwrap();
        let base = model.condense(None, &mut |_| {}).unwrap();
        let body = FreeBody::try_new(model.spread_loads(), &base).unwrap();
        Self { model, surface, base, body, columns: Columns::new(usize::MAX) }
    }

    /// A built-in object scaled to a size.
    pub(super) fn sized(shape: BuiltIn, nodes: usize, size: f64, young: f64, poisson: f64) -> Self {
        Self::new(sized_mesh(shape, nodes, size), young, poisson)
    }

    /// The same of ten-node elements, with so many corners.
    pub(super) fn quadratic(
        shape: BuiltIn,
        corners: usize,
        size: f64,
        young: f64,
        poisson: f64,
    ) -> Self {
        let mesh = sized_mesh(shape, corners, size);
        let mesh = QuadraticMesh::try_new(&mesh).unwrap().to_mesh().unwrap();
        Self::new(mesh, young, poisson)
    }

    pub(super) fn advance(
        &self,
        state: &ObjectState,
        bodies: &[MovingBody],
        settings: StepSettings,
    ) -> StepOutcome {
        self.with_step(state, bodies, settings, |step| {
            step.advance(state, &self.surface.nodes).unwrap()
        })
    }

    /// The same at large deformation.
    pub(super) fn advance_large(
        &self,
        large: &mut LargeBody,
        state: &ObjectState,
        bodies: &[MovingBody],
        settings: StepSettings,
    ) -> StepOutcome {
        self.try_advance_large(large, state, bodies, settings).unwrap()
    }

    /// The same, or why there is no such step.
    pub(super) fn try_advance_large(
        &self,
        large: &mut LargeBody,
        state: &ObjectState,
        bodies: &[MovingBody],
        settings: StepSettings,
    ) -> Result<StepOutcome, StepError> {
        self.with_step(state, bodies, settings, |step| {
            LargeStep { step, body: large }.advance(state, &self.surface.nodes)
        })
    }

    pub(super) fn with_step<T>(
        &self,
        state: &ObjectState,
        bodies: &[MovingBody],
        settings: StepSettings,
        make: impl FnOnce(ContactStep<'_>) -> T,
    ) -> T {
        let vertices = self.model.mesh().vertices();
        let elasticity = Elasticity { base: &self.base, body: &self.body, columns: &self.columns };
        let triangles = &self.surface.triangles;
        let margin = 0.3 * self.model.mesh().size();
        let candidates =
            near_triangles(vertices, triangles, &state.world_from_object, bodies, margin);
        let candidates = &candidates;
        let is_late = &|| false;
        make(ContactStep { vertices, triangles, elasticity, bodies, candidates, settings, is_late })
    }

    /// The object at large deformation, at rest.
    pub(super) fn large(&self, law: Law) -> LargeBody {
        let elements = Arc::new(self.model.hyperelastic(law).unwrap());
        LargeBody::at_rest(elements, Arc::clone(self.model.stiffness().pattern()))
    }

    /// The object at large deformation, at rest, of a material that yields.
    pub(super) fn yielding(&self, stress_pa: f64) -> LargeBody {
        let elements = self.model.hyperelastic(Law::NeoHookean).unwrap();
        let elements = Arc::new(elements.with_yield(stress_pa).unwrap());
        LargeBody::at_rest(elements, Arc::clone(self.model.stiffness().pattern()))
    }

    /// Mass at a density of 1000 kg/m³.
    pub(super) fn mass(&self) -> f64 {
        1000.0 * self.body.volume()
    }
}

/// A built-in object about the origin, scaled to a size.
fn sized_mesh(shape: BuiltIn, nodes: usize, size: f64) -> TetMesh {
    let mesh = generate(shape, nodes).unwrap();
    let (low, high) = mesh.bounds();
    let scale = size / (high - low).max();
    let middle = nalgebra::center(&low, &high);
    let vertices = mesh.vertices().iter().map(|p| Point3::from((p - middle) * scale)).collect();
    mesh.with_vertices(vertices).unwrap()
}

pub(super) fn table(friction: f64) -> MovingBody {
    MovingBody::resting(RigidShape::plane(Vector3::z()).unwrap(), Isometry3::identity(), friction)
}

pub(super) fn at(x: f64, y: f64, z: f64) -> Isometry3<f64> {
    Isometry3::from_parts(Translation3::new(x, y, z), UnitQuaternion::identity())
}

/// Lets an object rest on a table for some steps.
pub(super) fn settled(
    object: &Object,
    state: ObjectState,
    steps: usize,
) -> (ObjectState, StepOutcome) {
    let settings = StepSettings { viscosity: 0.02, ..StepSettings::default() };
    let mut found = object.advance(&state, &[table(0.5)], settings);
    for _ in 1..steps {
        found = object.advance(&found.state, &[table(0.5)], settings);
    }
    (found.state.clone(), found)
}

#[test]
fn cube_falls_on_a_table_and_lies_there_with_its_weight() {
    lies_with_its_weight(&Object::sized(BuiltIn::Cube, 125, 0.05, 2.0e4, 0.4));
}

/// Lets a cube of 50 mm fall on a table and compares the table's force with the weight.
pub(super) fn lies_with_its_weight(cube: &Object) {
    let (state, found) = settled(cube, ObjectState::at_rest(at(0.0, 0.0, 0.03)), 300);
    let weight = 9.81 * cube.mass();
    let force = found.loads[0].force;
    assert!((force.z - weight).abs() < 1e-9 * weight, "{force} {weight}");
    assert!(force.xy().norm() < 1e-9 * weight);
    assert!(state.velocity.norm() < 1e-9, "{}", state.velocity);
    assert!(found.penetration_max < 1e-6 * 0.05);
    assert!(found.is_converged);
}

#[test]
fn object_stands_still_on_a_slope_below_the_angle_of_friction_and_slides_above() {
    let cube = Object::sized(BuiltIn::Cube, 64, 0.05, 1.0e5, 0.3);
    let friction: f64 = 0.5;
    let angle = friction.atan();
    for (tilt, slides) in [(angle - 0.01, false), (angle + 0.01, true)] {
        let gravity = 9.81 * Vector3::new(tilt.sin(), 0.0, -tilt.cos());
        let settings = StepSettings { gravity, viscosity: 0.02, ..StepSettings::default() };
        let mut state = ObjectState::at_rest(at(0.0, 0.0, 0.025));
        let mut places = Vec::new();
        for _ in 0..300 {
            state = cube.advance(&state, &[table(friction)], settings).state;
            places.push(state.world_from_object.translation.x);
        }
        let moved = places[299] - places[199];
        match slides {
            true => {
                let pull = 9.81 * (tilt.sin() - friction * tilt.cos());
                // From the 200th step to the 300th: 2 s to 3 s of even acceleration.
                let expected = 0.5 * pull * (9.0 - 4.0);
                assert!((moved - expected).abs() < 0.05 * expected, "{moved} {expected}");
            }
            false => assert!(moved.abs() < 1e-9, "it creeps by {moved:e} m in a second"),
        }
    }
}

/// Pinches a ball from both sides, lifts it, and holds it; its height over time.
fn lift(depth: f64, friction: f64) -> (Vec<f64>, f64, Vec<StepOutcome>) {
    let ball = Object::sized(BuiltIn::Sphere, 400, 0.06, 2.0e4, 0.4);
    let tip = RigidShape::sphere(0.008).unwrap();
    let h = 0.01;
    // Seconds: 0.3 to settle, 0.3 to close, 0.5 to lift by 3 cm, 1 to hold.
    let pose = |side: f64, t: f64| {
        let closed = ((t - 0.3) / 0.3).clamp(0.0, 1.0);
        let lifted = ((t - 0.6) / 0.5).clamp(0.0, 1.0);
        at(side * (0.04 - closed * (0.002 + depth)), 0.0, 0.03 + 0.03 * lifted)
    };
    let mut state = ObjectState::at_rest(at(0.0, 0.0, 0.03));
    let settings = StepSettings {
        viscosity: 0.01,
        residual_rel: 1e-6,
        newton_max: 100,
        ..StepSettings::default()
    };
    let (mut heights, mut outcomes) = (Vec::new(), Vec::new());
    for step in 0..210 {
        let (from, to) = (f64::from(step) * h, f64::from(step + 1) * h);
        let finger = |side: f64| MovingBody {
            shape: tip.clone(),
            world_from_body_start: pose(side, from),
            world_from_body_end: pose(side, to),
            friction,
            compliance: 0.0,
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
    let held = last.loads[1].force.z + last.loads[2].force.z;
    assert!((held - weight).abs() < 1e-4 * weight, "{held} of {weight}");
    assert_eq!(last.loads[0].contacts, 0, "it still lies on the table");
    let end = heights.len() - 1;
    let drift = (heights[end] - heights[end - 40]).abs();
    assert!(drift < 1e-6, "{drift:e}");
    for (step, outcome) in outcomes.iter().enumerate() {
        assert!(outcome.is_converged, "step {step}: {:e}", outcome.contact_residual_rel);
        let largest = outcome.contacts.iter().map(|c| c.force.norm()).fold(0.0, f64::max);
        let outside = outcome.cone_violation;
        assert!(outside <= 1e-3 * largest, "step {step}: {outside:e} of {largest} N");
    }
}

#[test]
fn a_weak_pinch_slides_off_and_the_ball_stays_on_the_table() {
    let (heights, weight, outcomes) = lift(0.003, 0.3);
    let last = outcomes.last().unwrap();
    assert!(heights.last().unwrap() < &0.031, "{heights:?}");
    assert!((last.loads[0].force.z - weight).abs() < 0.01 * weight);
}

#[test]
fn a_finger_that_gives_way_presses_by_how_far_it_is_pushed_back() {
    let cube = Object::sized(BuiltIn::Cube, 125, 0.05, 2.0e4, 0.3);
    let (mut state, _) = settled(&cube, ObjectState::at_rest(at(0.0, 0.0, 0.025)), 50);
    let stiffness = 200.0;
    let finger = |from: f64, to: f64| MovingBody {
        shape: RigidShape::sphere(0.008).unwrap(),
        world_from_body_start: at(0.0, 0.0, from),
        world_from_body_end: at(0.0, 0.0, to),
        friction: 0.5,
        compliance: 1.0 / stiffness,
    };
    let settings = StepSettings { viscosity: 0.005, ..StepSettings::default() };
    let mut height = 0.06;
    let mut found = None;
    for step in 0..80 {
        // Down by 1 mm a step to 12 mm below where the top was, then still.
        let next = f64::max(height - 0.001, 0.05 + 0.008 - 0.012);
        let bodies = [table(0.5), finger(height, next)];
        let outcome = cube.advance(&state, &bodies, settings);
        let rel = outcome.contact_residual_rel;
        assert!(rel < 1e-3, "step {step}: {rel:e}");
        (height, state) = (next, outcome.state.clone());
        found = Some(outcome);
    }
    let found = found.unwrap();
    let force = -found.loads[1].force.z;
    let pushed_back = force / stiffness;
    // The lowest point of the finger as it is shown lies on the surface, which is dented.
    let tip = height + pushed_back - 0.008;
    assert!(force > 0.3, "{force}");
    let touching = found.contacts.iter().filter(|c| c.body == 1);
    let lowest = touching.map(|c| c.place.z).fold(f64::INFINITY, f64::min);
    assert!((lowest - tip).abs() < 1e-3, "{lowest} {tip}");
    assert!((found.loads[0].force.z - force - 9.81 * cube.mass()).abs() < 1e-6);
}

/// How far off the depth of a ball is that two planes press, by the force that it takes: depths count from the
/// poles of the sphere, which need not be nodes. Hertz's law is of half spaces; the far load moves the near pole by
/// what a point load does at the distance 2 R (Boussinesq), `(1 + ν)(3 − 2 ν) F / (4 π E R)`.
///
/// Source: Hertz (1881), F = 4/3 E* √R δ^(3/2); Boussinesq (1885).
pub(super) fn off_hertz(ball: &Object, radius: f64, (young, poisson): (f64, f64)) -> f64 {
    let floor = MovingBody { friction: 0.0, ..table(0.0) };
    let half_turn = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI);
    let settings = StepSettings { gravity: Vector3::zeros(), ..StepSettings::default() };
    let mut state = ObjectState::at_rest(at(0.0, 0.0, radius));
    let mut most: f64 = 0.0;
    for depth in [0.001, 0.002] {
        let height = Translation3::new(0.0, 0.0, 2.0 * (radius - depth));
        let lid = MovingBody {
            world_from_body_start: Isometry3::from_parts(height, half_turn),
            world_from_body_end: Isometry3::from_parts(height, half_turn),
            ..floor.clone()
        };
        let mut force = 0.0;
        for _ in 0..12 {
            let found = ball.advance(&state, &[floor.clone(), lid.clone()], settings);
            force = found.loads[1].normal_force;
            assert!(found.is_converged, "{depth} m");
            state = found.state;
        }
        let reduced = young / (1.0 - poisson * poisson);
        let local = (force / (4.0 / 3.0 * reduced * radius.sqrt())).powf(2.0 / 3.0);
        let pi = std::f64::consts::PI;
        let far = (1.0 + poisson) * (3.0 - 2.0 * poisson) * force / (4.0 * pi * young * radius);
        most = most.max(((local - far) / depth - 1.0).abs());
    }
    most
}

#[test]
fn ball_between_two_planes_presses_as_hertz_says_on_finer_and_finer_meshes() {
    let (radius, young, poisson) = (0.03, 2.0e4, 0.4);
    let mut worst = Vec::new();
    for (nodes, allowed) in [(500, 0.06), (1500, 0.045), (4000, 0.02)] {
        let ball = Object::sized(BuiltIn::Sphere, nodes, 2.0 * radius, young, poisson);
        let most = off_hertz(&ball, radius, (young, poisson));
        assert!(most < allowed, "{nodes} nodes: depth off by {most}");
        worst.push(most);
    }
    assert!(worst[2] < worst[0], "no better on a finer mesh: {worst:?}");
}

#[test]
fn more_points_than_a_problem_takes_are_refused_with_both_numbers() {
    let ball = Object::sized(BuiltIn::Sphere, 300, 0.06, 2.0e4, 0.4);
    let state = ObjectState::at_rest(at(0.0, 0.0, 0.029));
    let of = |points_max: usize| {
        let settings = StepSettings { points_max, ..StepSettings::default() };
        ball.with_step(&state, &[table(0.5)], settings, |step| step.advance(&state, &[]))
    };
    let points = of(StepSettings::POINTS_MOST).unwrap().contacts.len();
    assert!(points > 3, "{points}");
    match of(3).unwrap_err() {
        StepError::TooManyPoints { points: all, max: 3 } => assert!(all >= points, "{all}"),
        other => panic!("{other}"),
    }
}
