//! A soft ball that nothing holds, and its steps among rigid bodies: the object of the reports on contact.

use glove_client::run::contact_grasp::{NEWTON_MAX, ROUNDS_MAX};
use nalgebra::{Point3, Vector3};
use softgrasp_core::dynamics::{
    ContactStep, MovingBody, ObjectState, StepSettings, near_triangles, reach_of_step,
};
use softgrasp_core::fem::{Element, Material};
use softgrasp_core::mesh::{BuiltIn, Surface, generate};
use softgrasp_core::model::Model;
use softgrasp_core::solve::condensed::{Base, Columns, Elasticity, FreeBody};

use crate::report::ReportError;

/// Diameter of the ball, m, Young's modulus, Pa, and Poisson's ratio.
pub(crate) const SIZE: f64 = 0.07;
const YOUNG: f64 = 5.0e4;
const POISSON: f64 = 0.4;
/// Acceleration of free fall, m/s², along −y.
const GRAVITY: f64 = 9.81;

/// Ball, and all that its steps need.
pub(crate) struct Ball {
    pub model: Model,
    pub surface: Surface,
    base: Base,
    body: FreeBody,
    columns: Columns,
}

impl Ball {
    /// A ball of about so many nodes, centred at the origin.
    pub fn try_new(nodes: usize) -> Result<Self, ReportError> {
        let mesh = generate(BuiltIn::Sphere, nodes)?;
        let (low, high) = mesh.bounds();
        let scale = SIZE / (high - low).max();
        let scaled = mesh.vertices().iter().map(|p| Point3::from(scale * p.coords)).collect();
        let mesh = mesh.with_vertices(scaled)?;
        let surface = Surface::from_mesh(&mesh);
        let material = Material::try_new(YOUNG, POISSON)?;
        let model = Model::try_new(mesh, Element::Tet4, &[material], vec![], &mut |_| {})?;
        let base = model.condense(None, &mut |_| {})?;
        let body = FreeBody::try_new(model.spread_loads(), &base)?;
        Ok(Self { model, surface, base, body, columns: Columns::new(usize::MAX) })
    }

    /// Number of nodes.
    pub fn node_count(&self) -> usize {
        self.model.mesh().node_count()
    }

    /// Weight at a density of 1000 kg/m³, N.
    pub fn weight(&self) -> f64 {
        GRAVITY * 1000.0 * self.body.volume()
    }

    /// Passes on a step among bodies, with the triangles that a run would find near them.
    pub fn with_step<T>(
        &self,
        state: &ObjectState,
        bodies: &[MovingBody],
        settings: StepSettings,
        make: impl FnOnce(ContactStep<'_>) -> T,
    ) -> T {
        let vertices = self.model.mesh().vertices();
        let triangles = &self.surface.triangles;
        let speed = state.velocity.norm() + GRAVITY * settings.seconds;
        let turning = state.angular_velocity.norm();
        let reach = reach_of_step(SIZE, bodies, settings.seconds, (speed, turning));
        let near = near_triangles(vertices, triangles, &state.world_from_object, bodies, reach);
        let elasticity = Elasticity { base: &self.base, body: &self.body, columns: &self.columns };
        let (candidates, is_late) = (&near[..], &|| false);
        make(ContactStep { vertices, triangles, elasticity, bodies, candidates, settings, is_late })
    }
}

/// Settings of a step as a run asks for it.
///
/// Units: s.
pub(crate) fn as_a_run(seconds: f64, residual_rel: f64) -> StepSettings {
    StepSettings {
        seconds,
        gravity: Vector3::new(0.0, -GRAVITY, 0.0),
        viscosity: 0.02,
        residual_rel,
        rounds_max: ROUNDS_MAX as usize,
        newton_max: NEWTON_MAX as usize,
        ..StepSettings::default()
    }
}
