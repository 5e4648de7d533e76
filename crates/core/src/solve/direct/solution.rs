//! Loads, and the displacements and reactions that answer them.

use super::error::SolveError;
use super::factored::Factored;
use super::refinement::{Judged, refine};
use crate::fem::Stiffness;
use crate::solve::certainty::backward_error;
use crate::solve::k11::right_hand_side;
use crate::solve::pcg::{self, PcgParams};
use crate::solve::vectors::{norm, subtract};
use crate::solve::{Method, Partition, Stage};

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
    /// can stop early ([`Method::Pcg`]); zero asks for all there is.
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
    /// Componentwise backward error of the free rows: see [`Factored::certainty`].
    pub backward_error: f64,
    /// Estimate of `‖error‖ / ‖Q_u‖` where a method stops by it ([`Method::Pcg`]); no bound.
    pub error_estimate_rel: Option<f64>,
    /// Refinement steps taken.
    pub refinement_steps: u32,
}

/// Refinement and conjugate gradients stop at this relative residual.
const RESIDUAL_GOOD: f64 = 1e-13;
/// Refinement stops at this backward error; one step more would only move the last bits.
const BACKWARD_ERROR_GOOD: f64 = 1e-13;
/// Conjugate gradients stop after this many steps in any case.
const PCG_STEPS_MAX: u32 = 500;

impl Factored {
    /// Displacements and reactions for one set of loads: (3.43a) and (3.43b), refined while the
    /// residual falls.
    ///
    /// `stiffness` must be the one this was factored from.
    ///
    /// # Errors
    /// [`SolveError::LoadCount`], [`SolveError::NotFinite`].
    ///
    /// Source: thesis (3.43), (3.7).
    pub fn solve(
        &self,
        stiffness: &Stiffness,
        loads: Loads<'_>,
        on_stage: &mut dyn FnMut(Stage),
    ) -> Result<Solution, SolveError> {
        on_stage(Stage::Solve);
        check(self.partition(), loads)?;
        let (partition, method) = (self.partition(), self.method());
        let b = right_hand_side(stiffness, partition, loads.q_known, loads.forces);
        let b_norm = norm(&b);
        let mut q = vec![0.0; partition.dof_count()];
        for (&dof, &value) in partition.known().iter().zip(loads.q_known) {
            q[dof as usize] = value;
        }
        let mut x = match method {
            Method::Pcg => vec![0.0; b.len()],
            _ => self.apply_inverse(b.clone()),
        };
        let mut refinement_steps = 0;
        let mut error_estimate_rel = None;
        let apply = |x: &[f64]| self.apply_k11(stiffness, x);
        let mut residual = subtract(&b, &apply(&x));
        let mut judge = |x: &[f64], residual: &[f64]| {
            partition.scatter_unknown(x, &mut q);
            let backward_error = backward_error(stiffness, partition, &q, residual, loads.forces);
            let (backward, size) = (backward_error / BACKWARD_ERROR_GOOD, norm(residual));
            let off = if size > 0.0 { backward.max(size / (RESIDUAL_GOOD * b_norm)) } else { 0.0 };
            Judged { backward_error, off }
        };
        let mut judged = None;
        if method != Method::Pcg {
            let (steps, last) = refine(&self.kernel, &apply, &mut judge, &b, &mut x, &mut residual);
            (refinement_steps, judged) = (steps, Some(last));
        }
        // A single-precision factor that refinement cannot use any more still preconditions well.
        let single = self.kernel.is_single();
        if single && norm(&residual) > RESIDUAL_GOOD.max(loads.residual_rel) * b_norm {
            let params = PcgParams {
                residual_rel: RESIDUAL_GOOD.max(loads.residual_rel),
                // Without an error to reach the residual decides alone.
                error_rel: Some(loads.residual_rel).filter(|e| *e > 0.0).unwrap_or(f64::INFINITY),
                steps_max: PCG_STEPS_MAX,
            };
            let precondition = |r: &[f64]| self.apply_inverse(r.to_vec());
            let reached = pcg::solve(&apply, &precondition, &b, &mut x, params);
            residual = reached.residual;
            refinement_steps += reached.steps;
            error_estimate_rel = Some(reached.error_estimate_rel);
            judged = None;
        }
        let Judged { backward_error, .. } = judged.unwrap_or_else(|| judge(&x, &residual));
        // What was judged last need not be what was taken.
        partition.scatter_unknown(&x, &mut q);
        let f = stiffness.mul(&q);
        if !q.iter().all(|x| x.is_finite()) {
            return Err(SolveError::NotFinite { method });
        }
        let reaction = partition.known().iter().map(|&dof| f[dof as usize]).collect();
        let residual_rel = if b_norm > 0.0 { norm(&residual) / b_norm } else { norm(&residual) };
        Ok(Solution {
            displacement: q,
            reaction,
            residual_rel,
            backward_error,
            error_estimate_rel,
            refinement_steps,
        })
    }
}

/// Whether loads fit a partition.
fn check(partition: &Partition, loads: Loads<'_>) -> Result<(), SolveError> {
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
