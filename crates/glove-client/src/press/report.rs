//! The JSON report of a press: every step with pose, forces, penetration, slip, residuals, time.

use std::collections::BTreeMap;

use serde::Serialize;
use softgrasp_protocol::Deformation;

use super::course::Step;

/// Report of a press.
#[derive(Debug, Serialize)]
pub struct PressReport {
    /// Version of this form.
    pub schema: u32,
    /// The command.
    pub command: &'static str,
    /// The object's mesh file.
    pub mesh: String,
    /// Its nodes and tetrahedra.
    pub nodes: usize,
    /// Tetrahedra.
    pub tets: usize,
    /// Young's modulus, Pa.
    pub young: f64,
    /// Poisson's ratio.
    pub poisson: f64,
    /// kg/m³.
    pub density: f64,
    /// Mass, kg.
    pub mass: f64,
    /// Acceleration of free fall, m/s².
    pub gravity: [f64; 3],
    /// Friction of bodies that name none.
    pub friction: f64,
    /// Time in which the shape forgets a force, s.
    pub viscosity: f64,
    /// Finite element.
    pub element: String,
    /// `linear`, `large` or `auto`: what was asked for.
    pub deformation: &'static str,
    /// Law of large deformation, where it was asked for.
    pub material: Option<String>,
    /// Steps at large deformation.
    pub steps_large: usize,
    /// Steps whose gaps and residual are not within what was asked for.
    pub steps_not_converged: usize,
    /// Largest penetration of all steps, m.
    pub penetration_max: f64,
    /// Largest relative residual of contact of all steps.
    pub contact_residual_rel_max: f64,
    /// Largest residual of the elastic part of all steps, over its forces.
    pub residual_rel_max: f64,
    /// Every step.
    pub steps: Vec<StepReport>,
}

/// One step of a press.
#[derive(Debug, Serialize)]
pub struct StepReport {
    /// Time at the end of the step, s.
    pub time: f64,
    /// Pose of the object: x, y, z, qw, qx, qy, qz.
    pub object_pose: [f64; 7],
    /// Velocity of the centre of mass, m/s.
    pub object_velocity: [f64; 3],
    /// What each body does to the object.
    pub bodies: BTreeMap<String, BodyReport>,
    /// Deepest point of the surface in a body, m.
    pub penetration_max: f64,
    /// Longest slip of a pressing point in the step, m.
    pub slip_max: f64,
    /// Largest residual of the law of contact, N.
    pub contact_residual: f64,
    /// Residual of the law of contact over the largest force of a point.
    pub contact_residual_rel: f64,
    /// Largest part of a force outside its cone of friction, N.
    pub cone_violation: f64,
    /// Which law of friction the forces obey: always Coulomb's, never a relaxation.
    pub friction_law: &'static str,
    /// Whether gaps and residual are within what was asked for.
    pub converged: bool,
    /// Residual of the elastic part over its forces.
    pub residual_rel: f64,
    /// Bound of the error of the elastic part, or null.
    pub error_bound_rel: Option<f64>,
    /// Why there is no bound.
    pub why: String,
    /// Times the contact problem was made.
    pub rounds: u32,
    /// Steps of Newton's method.
    pub newton_steps: u32,
    /// Nodes whose columns were computed.
    pub columns_computed: u32,
    /// `linear` or `large`: which equations the step was solved by.
    pub deformation: &'static str,
    /// Shapes that contact was solved about.
    pub shapes: u32,
    /// Factors of the tangent that were made.
    pub factors: u32,
    /// Largest rotation of an element, degrees, where it was worked out.
    pub max_rotation_deg: Option<f64>,
    /// Largest strain of an element, where it was worked out.
    pub max_strain: Option<f64>,
    /// From sending to having the answer, ms.
    pub ms: f64,
}

/// What one body does to the object.
#[derive(Debug, Serialize)]
pub struct BodyReport {
    /// Force on the object, N.
    pub force: [f64; 3],
    /// Torque about the place of the body's pose, N m.
    pub torque: [f64; 3],
    /// Points that press.
    pub contacts: u32,
    /// Sum of the normal forces, N.
    pub normal_force: f64,
    /// Points that slip.
    pub slipping: usize,
}

impl StepReport {
    /// What is reported of a step.
    pub fn new(step: &Step, names: &[String]) -> Self {
        let answer = &step.answer;
        let slipping = |body: usize| {
            let of_body = answer.points.iter().filter(|point| point.body as usize == body);
            of_body.filter(|point| point.slips).count()
        };
        let bodies = names.iter().zip(&answer.loads).enumerate().map(|(at, (name, load))| {
            let report = BodyReport {
                force: load.force,
                torque: load.torque,
                contacts: load.contacts,
                normal_force: load.normal_force,
                slipping: slipping(at),
            };
            (name.clone(), report)
        });
        let (contact, report) = (&answer.contact, &answer.answer.report);
        Self {
            time: step.time,
            object_pose: answer.state.pose,
            object_velocity: answer.state.velocity,
            bodies: bodies.collect(),
            penetration_max: contact.penetration_max,
            slip_max: contact.slip_max,
            contact_residual: contact.residual,
            contact_residual_rel: contact.residual_rel,
            cone_violation: contact.cone_violation,
            friction_law: "coulomb",
            converged: contact.is_converged,
            residual_rel: report.residual_rel,
            error_bound_rel: report.error_bound_rel,
            why: report.error_bound_why.clone().unwrap_or_default(),
            rounds: contact.rounds,
            newton_steps: contact.newton_steps,
            columns_computed: contact.columns_computed,
            deformation: match contact.is_large {
                false => Deformation::Linear.as_str(),
                true => Deformation::Large.as_str(),
            },
            shapes: contact.shapes,
            factors: contact.factors,
            max_rotation_deg: Some(report.max_rotation_deg).filter(|angle| angle.is_finite()),
            max_strain: Some(report.max_strain).filter(|strain| strain.is_finite()),
            ms: step.ms,
        }
    }
}
