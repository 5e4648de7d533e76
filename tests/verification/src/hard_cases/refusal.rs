//! Kinds of refusals, to compare the reason of a refusal with the right one.

use softgrasp_core::model::ModelError;
use softgrasp_core::solve::condensed::CondensedError;
use softgrasp_core::solve::{Certainty, SolveError};
use softgrasp_protocol::{RejectCode, Rejected};

/// Kind of the reason of a refusal.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Reason {
    /// The question contradicts itself, or contains a number that is not finite.
    Question,
    /// A rigid motion is left free.
    Free,
    /// The body is held so weakly that rounding takes every digit.
    Weak,
    /// Numbers exceed the range of a double.
    Range,
    /// An element of the kept shape would be turned inside out.
    Inverted,
    /// Any other reason: memory, a broken connection.
    Other,
}

/// Refusal: its kind, and the sentence for the user.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Refusal {
    pub reason: Reason,
    pub text: String,
}

impl Reason {
    pub const fn name(self) -> &'static str {
        match self {
            Self::Question => "the question",
            Self::Free => "a free motion",
            Self::Weak => "held too weakly",
            Self::Range => "out of range",
            Self::Inverted => "elements inside out",
            Self::Other => "something else",
        }
    }
}

impl Refusal {
    pub fn new(reason: Reason, text: impl Into<String>) -> Self {
        Self { reason, text: text.into() }
    }

    /// Refusal because no digit of an answer is certain.
    pub fn uncertain(certainty: Certainty) -> Self {
        let Certainty { condition, error_rel } = certainty;
        let text = format!(
            "no digit of the answer is certain: the condition is {condition:.1e}, the error about \
             {error_rel:.1e}"
        );
        Self::new(Reason::Weak, text)
    }
}

impl From<ModelError> for Refusal {
    fn from(error: ModelError) -> Self {
        let reason = match &error {
            ModelError::Known(_) | ModelError::Partition(_) => Reason::Question,
            ModelError::Free(_) => Reason::Free,
            ModelError::Solve(error) => match error {
                SolveError::NotPositiveDefinite { .. } | SolveError::NotConverged { .. } => {
                    Reason::Weak
                }
                SolveError::NotFinite { .. } => Reason::Range,
                SolveError::LoadCount { .. } | SolveError::NoSuchFactor { .. } => Reason::Question,
                SolveError::OutOfMemory { .. } | SolveError::OverLimit { .. } => Reason::Other,
            },
            ModelError::Condensed(error) => match error {
                CondensedError::NotHeld => Reason::Free,
                CondensedError::HeldTooWeakly { .. }
                | CondensedError::NotPositiveDefinite { .. } => Reason::Weak,
                CondensedError::NotFinite => Reason::Range,
                CondensedError::Dependent { .. } => Reason::Question,
                _ => Reason::Other,
            },
            _ => Reason::Other,
        };
        Self::new(reason, error.to_string())
    }
}

impl From<SolveError> for Refusal {
    fn from(error: SolveError) -> Self {
        ModelError::from(error).into()
    }
}

impl From<CondensedError> for Refusal {
    fn from(error: CondensedError) -> Self {
        ModelError::from(error).into()
    }
}

impl From<Rejected> for Refusal {
    fn from(rejected: Rejected) -> Self {
        let Rejected { code, text, .. } = rejected;
        let reason = match code {
            RejectCode::RigidMotionFree => Reason::Free,
            RejectCode::NotPositiveDefinite | RejectCode::Uncertain => Reason::Weak,
            // One code for all that is wrong with a request: the sentence tells them apart.
            RejectCode::BadRequest if text.contains("too weakly") => Reason::Weak,
            RejectCode::BadRequest if text.contains("the answer is not finite") => Reason::Range,
            RejectCode::BadRequest => Reason::Question,
            _ => Reason::Other,
        };
        Self { reason, text }
    }
}
