//! The report of an answer: times, residual, error bound, warnings. Its fields are those of the JSON
//! reports.

use serde::{Serialize, Serializer};
use wincode::{SchemaRead, SchemaWrite};

use super::names::ElementUsed;
use crate::block::Block;
use crate::{DecodeError, EncodeError, Limits};

/// Wall time by stage, ms; a stage that was not needed is 0.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, SchemaRead, SchemaWrite)]
pub struct StageMs {
    /// Decoding the payload into the message.
    pub decode: f64,
    /// Assembling the stiffness matrix.
    pub assemble: f64,
    /// Finding an elimination order with little fill.
    pub order: f64,
    /// Factoring or inverting; with `condensed` computing the missing columns and the small system.
    pub factor: f64,
    /// Solving for the right-hand sides, with refinement.
    pub solve: f64,
    /// Collecting and rounding the results for the payload.
    pub encode: f64,
    /// Waiting for a worker thread.
    pub queue: f64,
}

/// How much of the report an answer carries.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, SchemaRead, SchemaWrite)]
pub enum ReportLevel {
    /// All numbers and texts.
    #[default]
    Full,
    /// All numbers; texts are empty.
    Short,
    /// No report: numbers are `None`, or NaN where there must be a number.
    None,
}

/// Severity of the loss of digits by rounding, by the estimate of the error; a number, since a later
/// version may have more levels.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, SchemaRead, SchemaWrite)]
pub struct WarningLevel(u32);

/// Subject of a warning, for programs; a number, since a later version may have more subjects.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, SchemaRead, SchemaWrite)]
pub struct WarningCode(pub u16);

/// Something about an answer that the user should know.
#[derive(Clone, Debug, Default, PartialEq, Eq, SchemaRead, SchemaWrite)]
pub struct Warning {
    /// Subject of the warning.
    pub code: WarningCode,
    /// Sentence of the warning, for people.
    pub text: String,
}

/// Report of one solve.
///
/// Units: `…_ms` ms, `…_rel` relative, `…_deg` degrees, `…_bytes` bytes.
#[derive(Clone, Debug, Default, PartialEq, Serialize, SchemaRead, SchemaWrite)]
pub struct SolveReport {
    /// Method that was used; never `auto`.
    pub method: String,
    /// Element that was used.
    pub element: ElementUsed,
    /// Number of degrees of freedom solved for.
    pub unknown_dofs: u64,
    /// Number of degrees of freedom that are known or fixed, and three for each mask.
    pub known_dofs: u64,
    /// Wall time by stage, ms.
    #[serde(rename = "ms")]
    pub stage_ms: StageMs,
    /// Norm of the residual over that of the right-hand side, at the unknown degrees of freedom.
    pub residual_rel: f64,
    /// Proven bound of the relative error of the displacements, if there is one.
    pub error_bound_rel: Option<f64>,
    /// Why there is no bound; `None` if there is one.
    #[serde(rename = "why")]
    pub error_bound_why: Option<String>,
    /// Number of steps of iterative refinement, or of conjugate gradients.
    pub refinement_steps: u32,
    /// Largest rotation of an element; linear elasticity is wrong where this is large. NaN where it was
    /// not computed for this answer.
    pub max_rotation_deg: f64,
    /// Largest principal strain of an element in magnitude; NaN where `max_rotation_deg` is.
    pub max_strain: f64,
    /// Arithmetic that was used, as `f64` or `f32 factor, f64 residual`.
    pub precision: String,
    /// Estimate of the condition number, if one was made: how much errors of rounding can grow.
    pub condition_estimate: Option<f64>,
    /// Estimate of the largest error over the largest displacement, if one was made; no bound.
    pub error_estimate_rel: Option<f64>,
    /// Severity of the loss of digits, by `error_estimate_rel`.
    pub warning_level: WarningLevel,
    /// Warnings for the user, in words.
    pub warnings: Vec<Warning>,
    /// Largest resident memory of the server since its start; 0 where the system does not tell.
    pub peak_rss_bytes: u64,
    /// Whether a factor, or the small system of `condensed`, was kept from an earlier question.
    pub factor_reused: bool,
    /// Why this method and element were chosen, in words.
    pub chosen_because: String,
}

impl WarningLevel {
    /// No loss of digits is known.
    pub const NONE: Self = Self(0);
    /// Digits are lost: the estimate is above 1e-9 and above the error that was asked for.
    pub const CAUTION: Self = Self(1);
    /// Few digits are left: the estimate is above 1e-3.
    pub const SERIOUS: Self = Self(2);

    /// Name of the level in reports; an unknown level is shown as a serious one.
    pub const fn as_str(self) -> &'static str {
        match self.0 {
            0 => "none",
            1 => "caution",
            _ => "serious",
        }
    }
}

impl Serialize for WarningLevel {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(self.as_str())
    }
}

impl WarningCode {
    /// An element rotates so far that linear elasticity is wrong there.
    pub const ROTATION: Self = Self(1);
    /// An element is strained more than linear elasticity is meant for.
    pub const STRAIN: Self = Self(2);
    /// Rounding has taken digits; the level says how many.
    pub const DIGITS: Self = Self(3);
    /// The answer is later than the deadline of the question.
    pub const LATE: Self = Self(4);
    /// The error may be larger than the question asked for.
    pub const ERROR: Self = Self(5);
    /// Deadline, error and memory did not go together: the choice of method gave up one of them.
    pub const CHOICE: Self = Self(6);
    /// Elements lock: the object appears stiffer than it is.
    pub const LOCKING: Self = Self(7);
    /// The touched nodes hold the body only weakly against rigid motion.
    pub const HOLD: Self = Self(8);
    /// The equilibrium jumped to another shape (snap-through).
    pub const SNAP: Self = Self(9);
    /// An element is pressed so far that surfaces crease.
    pub const CREASE: Self = Self(10);
    /// Linear elasticity answers while the equilibrium at large deformation is prepared.
    pub const PREPARING: Self = Self(11);
    /// Parts of the mesh itself lie in one another.
    pub const MESH: Self = Self(12);
}

impl Warning {
    /// A warning with code and sentence.
    pub fn new(code: WarningCode, text: impl Into<String>) -> Self {
        Self { code, text: text.into() }
    }
}

impl std::fmt::Display for Warning {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.pad(&self.text)
    }
}

impl Serialize for Warning {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(&self.text)
    }
}

impl SolveReport {
    /// The report with as much of it as was asked for.
    #[must_use]
    pub fn at_level(self, level: ReportLevel) -> Self {
        match level {
            ReportLevel::Full => self,
            ReportLevel::Short => Self {
                method: String::new(),
                error_bound_why: None,
                precision: String::new(),
                warnings: Vec::new(),
                chosen_because: String::new(),
                ..self
            },
            ReportLevel::None => Self::untold(),
        }
    }

    /// A report without content: what must be a number is NaN.
    pub fn untold() -> Self {
        Self {
            residual_rel: f64::NAN,
            max_rotation_deg: f64::NAN,
            max_strain: f64::NAN,
            ..Self::default()
        }
    }

    /// Whether the report is [`untold`](Self::untold).
    pub fn is_untold(&self) -> bool {
        self.residual_rel.is_nan()
    }

    /// Encoded report; no bytes for one that is [`untold`](Self::untold).
    pub(super) fn block(&self) -> Result<Block, EncodeError> {
        match self.is_untold() {
            true => Ok(Block::default()),
            false => Block::of(self),
        }
    }

    pub(super) fn read(block: &Block, limits: &Limits) -> Result<Self, DecodeError> {
        if block.is_empty() {
            return Ok(Self::untold());
        }
        let report: Self = block.read()?;
        limits.check_text("method", &report.method)?;
        let why = report.error_bound_why.iter();
        why.into_iter().try_for_each(|why| limits.check_text("reason of the error bound", why))?;
        limits.check_text("precision", &report.precision)?;
        limits.check_text("reason of the choice", &report.chosen_because)?;
        report
            .warnings
            .iter()
            .try_for_each(|warning| limits.check_text("warning", &warning.text))?;
        Ok(report)
    }
}
