//! Displacements and reactions for one load of a partition.

use super::block::Block;
use super::error::SolveError;
use super::factored::Factored;
use super::kernel::Kernel;
use super::refinement::{Judged, RESIDUAL_GOOD, refine};
use super::solution::{Loads, Solution, check};
use crate::fem::Stiffness;
use crate::solve::certainty::{Certainty, backward_error};
use crate::solve::k11::right_hand_side;
use crate::solve::pcg::{self, PcgParams};
use crate::solve::vectors::{norm, subtract};
use crate::solve::{Method, Stage};

/// Refinement stops a little short of its goal where rounding does; that far short is as good.
const SHORT_OF_GOAL: f64 = 10.0;
/// Conjugate gradients stop after this many steps in any case.
const PCG_STEPS_MAX: u32 = 500;

impl Factored {
    /// Displacements and reactions for one set of loads: (3.43a) and (3.43b), refined while the
    /// residual falls. Where refinement with a factor in single precision comes to a halt, double
    /// precision answers, as far as memory goes ([`super::Analysed::factor_within`]), and the solution says so.
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
        let first = self.with_kernel(|kernel| self.solve_by(kernel, stiffness, loads));
        let is_right = matches!(&first, Ok((_, is_right)) if *is_right);
        if is_right || !self.take_double(stiffness) {
            return first.map(|(solution, _)| solution);
        }
        self.with_kernel(|kernel| self.solve_by(kernel, stiffness, loads)).map(|found| found.0)
    }

    /// Solution of one load case, and how certain it is. Where no digit of an answer by single precision is
    /// certain, double precision answers, as far as memory goes.
    ///
    /// # Errors
    /// Those of [`Factored::solve`].
    pub fn solve_for_certain(
        &self,
        stiffness: &Stiffness,
        loads: Loads<'_>,
        on_stage: &mut dyn FnMut(Stage),
    ) -> Result<(Solution, Certainty), SolveError> {
        let solution = self.solve(stiffness, loads, on_stage)?;
        let certainty = solution.certainty(self, stiffness);
        // The certainty may itself have found out that single precision does not do.
        let is_older = self.fallback() != solution.fallback;
        if !self.is_to_solve_again(stiffness, is_older, certainty.is_none()) {
            return Ok((solution, certainty));
        }
        let solution = self.solve(stiffness, loads, on_stage)?;
        let certainty = solution.certainty(self, stiffness);
        Ok((solution, certainty))
    }

    /// Whether there is a better factor than the one an answer is of: since the answer (`is_older`), or
    /// now, because no digit of it is certain (`is_none`).
    pub(super) fn is_to_solve_again(
        &self,
        stiffness: &Stiffness,
        is_older: bool,
        is_none: bool,
    ) -> bool {
        is_older || (is_none && self.take_double(stiffness))
    }

    /// An answer by one factor or inverse, and whether refinement came to its goal.
    fn solve_by(
        &self,
        kernel: &Kernel,
        stiffness: &Stiffness,
        loads: Loads<'_>,
    ) -> Result<(Solution, bool), SolveError> {
        let (partition, method) = (self.partition(), self.method());
        if let Kernel::Multigrid(hierarchy) = kernel {
            return Ok((self.solve_by_cycles(hierarchy, stiffness, loads)?, true));
        }
        let is_single = kernel.is_single();
        let stops_early = is_single && method == Method::Pcg;
        let goal = RESIDUAL_GOOD.max(loads.residual_rel);
        if is_single && !stops_early {
            let found = Block::solve(partition, stiffness, kernel, &[loads], self.fallback()).pop();
            if let Some(solution) = found.flatten().filter(|found| found.residual_rel <= goal) {
                return Ok((solution, true));
            }
        }
        let b = right_hand_side(stiffness, partition, loads.q_known, loads.forces);
        let b_norm = norm(&b);
        let mut q = vec![0.0; partition.dof_count()];
        for (&dof, &value) in partition.known().iter().zip(loads.q_known) {
            q[dof as usize] = value;
        }
        let mut x = if stops_early { vec![0.0; b.len()] } else { kernel.apply(b.clone()) };
        let apply = |x: &[f64]| self.apply_k11(stiffness, x);
        let mut residual = subtract(&b, &apply(&x));
        let mut judge = |x: &[f64], residual: &[f64]| {
            partition.scatter_unknown(x, &mut q);
            let backward_error = backward_error(stiffness, partition, &q, residual, loads.forces);
            Judged::new(backward_error, norm(residual), b_norm)
        };
        let (mut refinement_steps, mut judged, mut is_right) = (0, None, true);
        if !stops_early {
            let refined = refine(kernel, &apply, &mut judge, &b, &mut x, &mut residual);
            is_right = !refined.has_stalled();
            (refinement_steps, judged) = (refined.steps, Some(refined.judged));
        }
        // A single-precision factor that refinement cannot use any more still preconditions well.
        let mut error_estimate_rel = None;
        if is_single && norm(&residual) > goal * b_norm {
            // Without an error to reach the residual decides alone.
            let error_rel = Some(loads.residual_rel).filter(|e| *e > 0.0).unwrap_or(f64::INFINITY);
            let params = PcgParams { residual_rel: goal, error_rel, steps_max: PCG_STEPS_MAX };
            let precondition = |r: &[f64]| kernel.apply(r.to_vec());
            let reached = pcg::solve(&apply, &precondition, &b, &mut x, params);
            residual = reached.residual;
            refinement_steps += reached.steps;
            error_estimate_rel = Some(reached.error_estimate_rel);
            judged = None;
            is_right &= norm(&residual) <= SHORT_OF_GOAL * goal * b_norm
                && reached.error_estimate_rel <= SHORT_OF_GOAL * error_rel;
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
        let solution = Solution {
            displacement: q,
            reaction,
            residual_rel,
            backward_error,
            error_estimate_rel,
            refinement_steps,
            fallback: self.fallback(),
        };
        Ok((solution, is_right))
    }
}

impl Solution {
    /// How certain an answer of a factor is; where the method stopped early, its own estimate counts
    /// beside rounding.
    pub(super) fn certainty(&self, factored: &Factored, stiffness: &Stiffness) -> Certainty {
        match self.error_estimate_rel {
            None => factored.certainty(stiffness, self.backward_error),
            Some(stopped_at) => {
                // What was stopped early on purpose is not judged by its residual.
                let is_whole = self.residual_rel <= SHORT_OF_GOAL * RESIDUAL_GOOD;
                let backward_error = if is_whole { self.backward_error } else { 0.0 };
                let rounding = factored.certainty(stiffness, backward_error);
                Certainty { error_rel: rounding.error_rel.max(stopped_at), ..rounding }
            }
        }
    }
}
