//! Errors of planning: why a question cannot be answered as it was asked.

use softgrasp_core::model::ModelError;

use super::shortage::Shortage;

/// Why a question cannot be answered as it was asked.
#[derive(Debug, thiserror::Error)]
pub(crate) enum PlanError {
    #[error("condensed takes known displacements only, not forces; use front or auto")]
    CondensedForces,
    #[error("node {node} is fixed by the model and moved by the question; use front or auto")]
    FixedMoved { node: u32 },
    #[error("{method} does not answer masks; ask for condensed or auto")]
    MasksDirect { method: softgrasp_core::solve::Method },
    #[error("masks are answered by condensed only, and not here: {0}")]
    MasksNotCondensed(Box<PlanError>),
    #[error("{0}")]
    Memory(Box<Shortage>),
    #[error(transparent)]
    Model(#[from] ModelError),
}
