//! Names of the stages of an answer, the same in the core, on the wire and in every report.

/// A stage of the work. The core has no clock: it announces each stage as it begins, and whoever
/// called takes the time.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Stage {
    /// Stiffness from mesh and material.
    Assemble,
    /// Fill-reducing order and symbolic analysis.
    Order,
    /// Numerical factor or inverse of `K11`.
    Factor,
    /// Right-hand side, substitution, refinement, residual, reactions.
    Solve,
}
