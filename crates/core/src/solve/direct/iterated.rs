//! Answers without a factor: conjugate gradients by a hierarchy.

use super::error::SolveError;
use super::factored::Factored;
use super::solution::{Loads, Solution};
use crate::fem::Stiffness;
use crate::solve::certainty::backward_error;
use crate::solve::k11::right_hand_side;
use crate::solve::multigrid::{self, Goal, Hierarchy};
use crate::solve::rates::ERROR_ITERATED;

/// Relative residual to reach where nothing else is asked for.
const RESIDUAL_ITERATED: f64 = 1e-12;
/// Conjugate gradients stop after this many steps in any case.
const STEPS_MAX: u32 = 1000;
/// Where rounding ends the steps, an answer with an estimated error this far above the goal is given,
/// and says so.
const SHORT_OF_GOAL: f64 = 100.0;
/// Error to which a condition number's solves go.
const ERROR_OF_CONDITION: f64 = 0.1;

impl Factored {
    /// Displacements and reactions by conjugate gradients.
    ///
    /// # Errors
    /// [`SolveError::NotConverged`], [`SolveError::NotFinite`].
    pub(super) fn solve_by_cycles(
        &self,
        hierarchy: &Hierarchy,
        stiffness: &Stiffness,
        loads: Loads<'_>,
    ) -> Result<Solution, SolveError> {
        let (partition, method) = (self.partition(), self.method());
        let mut b = vec![0.0; partition.dof_count()];
        let of_rows = right_hand_side(stiffness, partition, loads.q_known, loads.forces);
        partition.scatter_unknown(&of_rows, &mut b);
        let (residual_rel, error_rel) = match loads.residual_rel > 0.0 {
            true => {
                (loads.residual_rel.max(RESIDUAL_ITERATED), loads.residual_rel.max(ERROR_ITERATED))
            }
            false => (RESIDUAL_ITERATED, ERROR_ITERATED),
        };
        let goal = Goal { residual_rel, error_rel, steps_max: STEPS_MAX };
        let found = multigrid::solve(stiffness, partition, hierarchy, &b, goal);
        let mut q = found.x;
        for (&dof, &value) in partition.known().iter().zip(loads.q_known) {
            q[dof as usize] = value;
        }
        if !q.iter().all(|x| x.is_finite()) {
            return Err(SolveError::NotFinite { method });
        }
        let error_estimate_rel = found.error_estimate_rel;
        // A NaN is no answer either.
        let is_answer = error_estimate_rel <= SHORT_OF_GOAL * error_rel;
        if !is_answer {
            let (steps, residual_rel) = (found.steps, found.residual_rel);
            return Err(SolveError::NotConverged {
                method,
                steps,
                residual_rel,
                error_estimate_rel,
                error_rel,
            });
        }
        let residual: Vec<f64> =
            partition.unknown().iter().map(|&dof| found.residual[dof as usize]).collect();
        let f = stiffness.mul(&q);
        Ok(Solution {
            reaction: partition.known().iter().map(|&dof| f[dof as usize]).collect(),
            backward_error: backward_error(stiffness, partition, &q, &residual, loads.forces),
            displacement: q,
            residual_rel: found.residual_rel,
            error_estimate_rel: Some(error_estimate_rel),
            refinement_steps: found.steps,
            fallback: None,
        })
    }

    /// `K11⁻¹ B` to a digit at least, for columns of n, one behind the other; no number where a digit
    /// is not reached.
    pub(super) fn inverse_by_cycles(
        &self,
        hierarchy: &Hierarchy,
        stiffness: &Stiffness,
        b: &[f64],
    ) -> Vec<f64> {
        let partition = self.partition();
        let n = partition.unknown().len();
        let goal = Goal { residual_rel: 1.0, error_rel: ERROR_OF_CONDITION, steps_max: STEPS_MAX };
        let of_column = |b: &[f64]| {
            let mut all = vec![0.0; partition.dof_count()];
            partition.scatter_unknown(b, &mut all);
            let found = multigrid::solve(stiffness, partition, hierarchy, &all, goal);
            let is_digit = found.error_estimate_rel <= ERROR_OF_CONDITION;
            let x = partition.unknown().iter().map(|&dof| found.x[dof as usize]);
            x.map(|x| if is_digit { x } else { f64::NAN }).collect::<Vec<f64>>()
        };
        b.chunks(n.max(1)).flat_map(of_column).collect()
    }
}
