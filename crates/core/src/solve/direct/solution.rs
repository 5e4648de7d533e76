//! Loads, and the displacements and reactions that they cause.

use super::error::SolveError;
use super::fallback::Fallback;
use crate::solve::Partition;

/// Known displacements and external forces of one answer.
///
/// Shapes: `q_known` one per known degree of freedom of the partition, in its order; `forces`
/// empty or 3N (entries on known degrees of freedom must be zero). Units: m, N.
#[derive(Clone, Copy, Debug, Default)]
pub struct Loads<'a> {
    /// `Q_k`.
    pub q_known: &'a [f64],
    /// `f₁` of (3.7), scattered over all degrees of freedom.
    pub forces: &'a [f64],
    /// Relative residual and estimated relative error that are good enough, both, for a method that
    /// can stop early ([`Method::Pcg`](crate::solve::Method::Pcg)); zero asks for all there is.
    pub residual_rel: f64,
}

/// Displacements, reactions and how exact they are.
#[derive(Clone, Debug, PartialEq)]
pub struct Solution {
    /// Displacement of every degree of freedom, 3N, m; zero at orphan nodes.
    pub displacement: Vec<f64>,
    /// Reaction `F_u` (3.43b) of every known degree of freedom, in the partition's order, N.
    pub reaction: Vec<f64>,
    /// `‖K11 Q_u − b‖₂ / ‖b‖₂`, zero when `b` is.
    pub residual_rel: f64,
    /// Componentwise backward error of the free rows: see [`certainty`](super::Factored::certainty).
    pub backward_error: f64,
    /// Estimate of `‖error‖ / ‖Q_u‖` where a method stops by it, as `Method::Pcg` does; no bound.
    pub error_estimate_rel: Option<f64>,
    /// Refinement steps taken.
    pub refinement_steps: u32,
    /// Why double precision answered where single had been asked for, if it did.
    pub fallback: Option<Fallback>,
}

/// Whether loads fit a partition.
pub(super) fn check(partition: &Partition, loads: Loads<'_>) -> Result<(), SolveError> {
    let expected = partition.known().len();
    if loads.q_known.len() != expected {
        let given = loads.q_known.len();
        return Err(SolveError::LoadCount { what: "known displacements", given, expected });
    }
    let expected = partition.dof_count();
    if !loads.forces.is_empty() && loads.forces.len() != expected {
        let given = loads.forces.len();
        return Err(SolveError::LoadCount { what: "external forces", given, expected });
    }
    Ok(())
}
