//! The report of an answer: times, residual, error bound, warnings.

use wincode::{SchemaRead, SchemaWrite};

use super::names::ElementName;
use crate::{DecodeError, Limits};

/// Wall time by stage, ms; a stage that was not needed is 0.
#[derive(Clone, Copy, Debug, Default, PartialEq, SchemaRead, SchemaWrite)]
pub struct StageMs {
    /// Payload to arrays.
    pub decode: f64,
    /// Stiffness matrix.
    pub assemble: f64,
    /// Fill-reducing order.
    pub order: f64,
    /// Factorisation or inversion.
    pub factor: f64,
    /// Right-hand sides and refinement.
    pub solve: f64,
    /// Arrays to payload.
    pub encode: f64,
    /// Waiting for a worker.
    pub queue: f64,
}

/// How much of an answer rounding has left, by the estimate of its error.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, SchemaRead, SchemaWrite)]
pub enum WarningLevel {
    /// Nothing is known to be amiss.
    #[default]
    None,
    /// Digits are lost: the estimate is above 1e-9, or above the error that was asked for.
    Caution,
    /// Few digits are left: the estimate is above 1e-3.
    Serious,
}

impl WarningLevel {
    /// Name used in reports.
    pub const fn as_str(self) -> &'static str {
        match self {
            Self::None => "none",
            Self::Caution => "caution",
            Self::Serious => "serious",
        }
    }
}

/// Report of one solve.
///
/// Units: `…_ms` ms, `…_rel` relative, `…_deg` degrees, `…_bytes` bytes.
#[derive(Clone, Debug, Default, PartialEq, SchemaRead, SchemaWrite)]
pub struct SolveReport {
    /// Method that was used.
    pub method: String,
    /// Element that was used.
    pub element: ElementName,
    /// Degrees of freedom solved for.
    pub unknown_dofs: u64,
    /// Degrees of freedom given.
    pub known_dofs: u64,
    /// Wall time by stage.
    pub stage_ms: StageMs,
    /// Residual over right-hand side, on the free rows.
    pub residual_rel: f64,
    /// Bound of the relative error, if one could be had.
    pub error_bound_rel: Option<f64>,
    /// Where the bound comes from, or why there is none.
    pub error_bound_why: String,
    /// Steps of iterative refinement.
    pub refinement_steps: u32,
    /// Largest rotation of an element; linear elasticity is wrong where this is large. NaN where it
    /// was not worked out for this answer.
    pub max_rotation_deg: f64,
    /// Largest principal strain, NaN likewise.
    pub max_strain: f64,
    /// Arithmetic that was used.
    pub precision: String,
    /// Estimate of the condition number, if one was made: how much errors of rounding can grow.
    pub condition_estimate: Option<f64>,
    /// Estimate of the largest error over the largest displacement, if one was made; no bound.
    pub error_estimate_rel: Option<f64>,
    /// What the estimate means.
    pub warning_level: WarningLevel,
    /// What the user should know.
    pub warnings: Vec<String>,
    /// Largest resident memory of the server so far.
    pub peak_rss_bytes: u64,
    /// Whether a kept factor was used.
    pub factor_reused: bool,
    /// Why this method.
    pub chosen_because: String,
}

impl SolveReport {
    pub(super) fn check(&self, limits: &Limits) -> Result<(), DecodeError> {
        limits.check_text("method", &self.method)?;
        limits.check_text("reason of the error bound", &self.error_bound_why)?;
        limits.check_text("precision", &self.precision)?;
        limits.check_text("reason of the choice", &self.chosen_because)?;
        self.warnings.iter().try_for_each(|warning| limits.check_text("warning", warning))
    }
}
