//! The part of every JSON report about one solve: method, times, residual, error bound.

use serde::Serialize;

use crate::{DeformationName, LargeReport, SolveReport, StageMs};

/// Version of the JSON reports; changes when a field changes its meaning or goes.
pub const SCHEMA: u32 = 1;

/// One solve, in the names of the command contract.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SolveSummary {
    /// Method used.
    pub method: String,
    /// Element used.
    pub element: &'static str,
    /// Size of `K11`.
    pub unknown_dofs: u64,
    /// Number of known degrees of freedom.
    pub known_dofs: u64,
    /// Milliseconds by stage, on the server.
    pub ms: StageSummary,
    /// Milliseconds from sending the request to having the answer, on the client.
    pub round_trip_ms: f64,
    /// Bytes of the request on the wire.
    pub request_bytes: u64,
    /// Bytes of the answer on the wire.
    pub answer_bytes: u64,
    /// `‖K11 Q_u − b‖ / ‖b‖`.
    pub residual_rel: f64,
    /// Proven bound on the relative error, or null.
    pub error_bound_rel: Option<f64>,
    /// Estimate of the largest error over the largest displacement, or null where none was made.
    pub error_estimate_rel: Option<f64>,
    /// Estimate of how much errors of rounding can grow, or null.
    pub condition_estimate: Option<f64>,
    /// `none`, `caution` (digits are lost) or `serious` (few are left), by the estimate.
    pub warning_level: &'static str,
    /// Why there is no bound; null when there is one.
    pub why: Option<String>,
    /// Refinement steps taken.
    pub refinement_steps: u32,
    /// Largest rotation of an element, degrees; null where there was no time to work it out.
    pub max_rotation_deg: f64,
    /// Largest principal strain of an element, or null.
    pub max_strain: f64,
    /// Precision of the factor.
    pub precision: String,
    /// Whether an earlier factor served again.
    pub factor_reused: bool,
    /// Why this method.
    pub chosen_because: String,
    /// What the user should know.
    pub warnings: Vec<String>,
    /// Largest resident memory of the server so far, bytes.
    pub peak_rss_bytes: u64,
    /// `linear` or `large`: the equations that were solved.
    pub deformation: &'static str,
    /// What is known of an equilibrium at large deformation; its fields are left out for a linear
    /// question.
    #[serde(flatten)]
    pub large: Option<LargeSummary>,
}

/// One equilibrium at large deformation.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct LargeSummary {
    /// Steps with a tangent, or with a correction of one.
    pub newton_steps: u32,
    /// Solves with a factor.
    pub linear_solves: u32,
    /// Frames since the shape that the newest factor belongs to.
    pub factor_age: u32,
    /// Pieces that the motion of the known displacements was cut into.
    pub substeps: u32,
    /// Smallest ratio of an element's volume to that at rest.
    pub min_jacobian: f64,
    /// Estimated error in the energy norm, or null.
    pub energy_error_rel: Option<f64>,
    /// Largest principal stretch of an element, or null.
    pub max_stretch: f64,
    /// The equilibrium jumped.
    pub jumped: bool,
    /// The residual is rounding or below 1e-8.
    pub settled: bool,
    /// Largest plastic strain; 0 without yield stress.
    pub plastic_strain: f64,
}

impl LargeSummary {
    fn new(report: &LargeReport) -> Self {
        Self {
            newton_steps: report.newton_steps,
            linear_solves: report.linear_solves,
            factor_age: report.factor_age,
            substeps: report.substeps,
            min_jacobian: report.min_jacobian,
            energy_error_rel: report.energy_error_rel,
            max_stretch: report.max_stretch,
            jumped: report.jumped,
            settled: report.settled,
            plastic_strain: report.plastic_strain,
        }
    }
}

/// Milliseconds by stage.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct StageSummary {
    /// Bytes to request.
    pub decode: f64,
    /// Stiffness.
    pub assemble: f64,
    /// Fill-reducing order and symbolic analysis.
    pub order: f64,
    /// Factor or inverse.
    pub factor: f64,
    /// Substitution, refinement, residual.
    pub solve: f64,
    /// Gathering the rows asked for.
    pub encode: f64,
    /// Waiting for the solving threads.
    pub queue: f64,
}

impl SolveSummary {
    /// With a warning, the first of all.
    #[must_use]
    pub fn with_first_warning(mut self, warning: Option<String>) -> Self {
        self.warnings.splice(0..0, warning);
        self
    }

    /// From the wire's report and the time the client waited.
    pub fn new(report: &SolveReport, round_trip_ms: f64) -> Self {
        let StageMs { decode, assemble, order, factor, solve, encode, queue } = report.stage_ms;
        let why = match report.error_bound_rel {
            Some(_) => None,
            None => Some(report.error_bound_why.clone()),
        };
        Self {
            method: report.method.clone(),
            element: report.element.as_str(),
            unknown_dofs: report.unknown_dofs,
            known_dofs: report.known_dofs,
            ms: StageSummary { decode, assemble, order, factor, solve, encode, queue },
            round_trip_ms,
            request_bytes: 0,
            answer_bytes: 0,
            residual_rel: report.residual_rel,
            error_bound_rel: report.error_bound_rel,
            error_estimate_rel: report.error_estimate_rel,
            condition_estimate: report.condition_estimate,
            warning_level: report.warning_level.as_str(),
            why,
            refinement_steps: report.refinement_steps,
            max_rotation_deg: report.max_rotation_deg,
            max_strain: report.max_strain,
            precision: report.precision.clone(),
            factor_reused: report.factor_reused,
            chosen_because: report.chosen_because.clone(),
            warnings: report.warnings.clone(),
            peak_rss_bytes: report.peak_rss_bytes,
            deformation: DeformationName::Linear.as_str(),
            large: None,
        }
    }

    /// The same with what was reported of an equilibrium at large deformation, if it was one.
    pub fn with_large(self, large: Option<&LargeReport>) -> Self {
        let deformation = large.map_or(self.deformation, |large| large.deformation.as_str());
        Self { deformation, large: large.map(LargeSummary::new), ..self }
    }

    /// The same with the bytes of request and answer on the wire.
    pub fn with_bytes(self, [request_bytes, answer_bytes]: [u64; 2]) -> Self {
        Self { request_bytes, answer_bytes, ..self }
    }
}
