//! The answer to a hard case, in the same form for every method.

use std::time::Instant;

use softgrasp_core::solve::Certainty;

use super::refusal::Refusal;

/// What a way answers.
#[derive(Clone, Debug)]
pub(super) struct Answer {
    /// Of every degree of freedom of the system, m; over a socket, of every node of the mesh.
    pub displacement: Vec<f64>,
    pub residual_rel: f64,
    pub condition: f64,
    /// Error that the answer states of itself.
    pub stated_rel: f64,
    /// Proven bound on the norm of the error over that of the answer.
    pub bound_rel: Option<f64>,
    /// What the answer says of how it was made, where that is not as asked.
    pub remark: String,
    /// From the mesh to the displacements.
    pub ms: f64,
}

impl Answer {
    /// The answer, unless no digit of it is certain.
    ///
    /// # Errors
    /// [`Refusal`] with the error and the condition.
    pub fn if_certain(self) -> Result<Self, Refusal> {
        let certainty = Certainty { condition: self.condition, error_rel: self.stated_rel };
        match certainty.is_none() {
            true => Err(Refusal::uncertain(certainty)),
            false => Ok(self),
        }
    }
}

/// Milliseconds since then.
pub(super) fn since(begin: Instant) -> f64 {
    1e3 * begin.elapsed().as_secs_f64()
}
