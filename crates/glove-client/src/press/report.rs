//! The JSON report of a press: every step with pose, forces, penetration, slip, residuals, time.

use std::collections::BTreeMap;

use serde::Serialize;
use softgrasp_protocol::Deformation;

use super::bodies_file::PressBodies;
use super::course::Step;

/// JSON report of a press.
#[derive(Debug, Serialize)]
pub struct PressReport {
    /// Version of the report's form.
    pub schema: u32,
    /// Name of the command.
    pub command: &'static str,
    /// Path of the object's mesh file.
    pub mesh: String,
    /// Number of nodes of the object.
    pub nodes: usize,
    /// Number of tetrahedra of the object.
    pub tets: usize,
    /// Young's modulus, Pa.
    pub young: f64,
    /// Poisson's ratio.
    pub poisson: f64,
    /// Density of the object, kg/m³.
    pub density: f64,
    /// Mass of the object, kg.
    pub mass: f64,
    /// Acceleration of free fall, m/s², in the world frame.
    pub gravity: [f64; 3],
    /// Coefficient of friction of bodies that name none.
    pub friction: f64,
    /// Time constant with which the shape forgets a force (Kelvin and Voigt), s.
    pub viscosity: f64,
    /// Name of the finite element.
    pub element: String,
    /// Equations that were asked for: `linear`, `large` or `auto`.
    pub deformation: &'static str,
    /// Law of large deformation, where that was asked for.
    pub material: Option<String>,
    /// Yield stress, Pa; null for a material that never flows.
    pub yield_pa: Option<f64>,
    /// What ended the press before its time, with the time; null where all steps are made.
    pub ended_early: Option<String>,
    /// Number of steps at large deformation.
    pub steps_large: usize,
    /// Number of steps whose penetration or residual is above what was asked for.
    pub steps_not_converged: usize,
    /// Number of those steps that their deadline has ended.
    pub steps_late: usize,
    /// Largest penetration of all steps, m.
    pub penetration_max: f64,
    /// Largest residual of the law of contact of all steps, relative.
    pub contact_residual_rel_max: f64,
    /// Largest residual of the elastic part of all steps, relative to its forces.
    pub residual_rel_max: f64,
    /// All steps, in their order.
    pub steps: Vec<StepReport>,
}

/// One step of a press.
#[derive(Debug, Serialize)]
pub struct StepReport {
    /// Time at the end of the step, s.
    pub time: f64,
    /// Pose of the object in the world: x, y, z in m, quaternion w, x, y, z.
    pub object_pose: [f64; 7],
    /// Velocity of the object's centre of mass, m/s, in the world frame.
    pub object_velocity: [f64; 3],
    /// Forces of each body on the object, by the body's name.
    pub bodies: BTreeMap<String, BodyReport>,
    /// Deepest point of the surface in a body, m.
    pub penetration_max: f64,
    /// Longest slip of a pressing point in the step, m.
    pub slip_max: f64,
    /// Largest residual of the law of contact, N.
    pub contact_residual: f64,
    /// Residual of the law of contact, relative to the largest force of a point.
    pub contact_residual_rel: f64,
    /// Largest part of a force outside its cone of friction, N.
    pub cone_violation: f64,
    /// Name of the law of friction that the forces obey: always Coulomb's, never a relaxation.
    pub friction_law: &'static str,
    /// Whether penetration and residual are within what was asked for.
    pub converged: bool,
    /// Whether the deadline has ended the step before that.
    pub late: bool,
    /// Residual of the elastic part, relative to its forces.
    pub residual_rel: f64,
    /// Proven bound of the relative error of the elastic part, or null.
    pub error_bound_rel: Option<f64>,
    /// Reason why there is no bound.
    pub why: String,
    /// Number of times that the contact problem was made.
    pub rounds: u32,
    /// Number of steps of Newton's method.
    pub newton_steps: u32,
    /// Number of nodes whose columns were computed.
    pub columns_computed: u32,
    /// Equations that the step was solved by: `linear` or `large`.
    pub deformation: &'static str,
    /// Number of shapes that contact was solved about.
    pub shapes: u32,
    /// Number of factors of the tangent that were made.
    pub factors: u32,
    /// Largest accumulated plastic strain, 0 without a yield stress.
    pub plastic_strain: f64,
    /// Largest rotation of an element, degrees, if it was computed.
    pub max_rotation_deg: Option<f64>,
    /// Largest strain of an element, if it was computed.
    pub max_strain: Option<f64>,
    /// Time from sending the request to having the answer, ms.
    pub ms: f64,
}

/// Force and torque of one body on the object.
#[derive(Debug, Serialize)]
pub struct BodyReport {
    /// Force on the object, N, in the world frame.
    pub force: [f64; 3],
    /// Torque about the position of the body's pose, N m, in the world frame.
    pub torque: [f64; 3],
    /// Number of points that press.
    pub contacts: u32,
    /// Sum of the normal components of the forces, N.
    pub normal_force: f64,
    /// Number of points that slip.
    pub slipping: usize,
}

impl PressReport {
    /// The press in a few lines of text.
    pub fn told(&self, bodies: &PressBodies) -> String {
        let mut text = format!(
            "{}: {} nodes, {} tetrahedra, {:.1} g\n{} of {:.4} s, deepest penetration {:.1e} m, \
             residual of contact {:.1e} at most\n",
            self.mesh,
            self.nodes,
            self.tets,
            1e3 * self.mass,
            steps(self.steps.len()),
            bodies.end / self.steps.len().max(1) as f64,
            self.penetration_max,
            self.contact_residual_rel_max,
        );
        text.push_str(&self.told_of_unconverged(bodies));
        if self.deformation != Deformation::Linear.as_str() {
            text.push_str(&format!(
                "{} at large deformation, forces out of balance by {:.1e} at most\n",
                steps(self.steps_large),
                self.residual_rel_max
            ));
        }
        for (name, body) in self.steps.last().iter().flat_map(|last| &last.bodies) {
            let [x, y, z] = body.force;
            text.push_str(&format!(
                "at the end {name} presses at {} points with {:.4} N: ({x:.4}, {y:.4}, {z:.4}) N\n",
                body.contacts, body.normal_force
            ));
        }
        text
    }

    /// Steps that have not converged, and the body whose sharp edges they touch.
    fn told_of_unconverged(&self, bodies: &PressBodies) -> String {
        if self.steps_not_converged == 0 {
            return String::new();
        }
        let mut text = format!(
            "{} above the residual asked for; the report says how far\n",
            match self.steps_not_converged {
                1 => "1 step ends".to_owned(),
                count => format!("{count} steps end"),
            }
        );
        if self.steps_late > 0 {
            text.push_str(&format!("the deadline has ended {}\n", steps(self.steps_late)));
        }
        let touches = |step: &StepReport, name: &str| {
            step.bodies.get(name).is_some_and(|body| body.contacts > 0)
        };
        let fails =
            |name: &str| self.steps.iter().any(|step| !step.converged && touches(step, name));
        let sharp = bodies.sharp().find(|name| fails(name));
        if let Some(name) = sharp {
            text.push_str(&format!(
                "{name} has sharp edges, at which contact often does not converge: a radius in its \
                 [[body]] rounds them\n"
            ));
        }
        text
    }
}

/// A number of steps in words.
pub fn steps(count: usize) -> String {
    match count {
        1 => "1 step".to_owned(),
        _ => format!("{count} steps"),
    }
}

impl StepReport {
    /// Report of one step; `names` are those of the bodies.
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
            late: contact.is_late,
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
            plastic_strain: contact.plastic_strain,
            max_rotation_deg: Some(report.max_rotation_deg).filter(|angle| angle.is_finite()),
            max_strain: Some(report.max_strain).filter(|strain| strain.is_finite()),
            ms: step.ms,
        }
    }
}
