//! Answer to a hard case, in the same form for every method.

use std::time::Instant;

use softgrasp_core::solve::Certainty;

use super::refusal::Refusal;

/// Answer of a way.
#[derive(Clone, Debug)]
pub(super) struct Answer {
    /// Displacement of every degree of freedom of the system, m; over a socket, of every node of the
    /// mesh.
    pub displacement: Vec<f64>,
    pub residual_rel: f64,
    pub condition: f64,
    /// Relative error that the answer states.
    pub stated_rel: f64,
    /// Proven bound on the norm of the error, relative to that of the answer.
    pub bound_rel: Option<f64>,
    /// Remark on how the answer was made, if not as asked.
    pub remark: String,
    /// Time from the mesh to the displacements, ms.
    pub ms: f64,
}

impl Answer {
    /// The answer, unless none of its digits is certain.
    ///
    /// # Errors
    /// [`Refusal`] with the error and the condition number.
    pub fn if_certain(self) -> Result<Self, Refusal> {
        let certainty = Certainty { condition: self.condition, error_rel: self.stated_rel };
        match certainty.is_none() {
            true => Err(Refusal::uncertain(certainty)),
            false => Ok(self),
        }
    }
}

/// Time since `begin`, ms.
pub(super) fn since(begin: Instant) -> f64 {
    1e3 * begin.elapsed().as_secs_f64()
}
