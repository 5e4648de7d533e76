//! The points of a contact problem that press, or would be pressed into: the others have no force, and
//! only these have to be solved for.

use nalgebra::DMatrix;

use super::problem::{ContactProblem, at};
use super::solution::{Solution, SolveBudget};

/// Times that points are added before all of them are solved for.
const ADDITIONS_MAX: usize = 8;

impl ContactProblem {
    /// The forces that obey the law of Signorini and Coulomb: exactly that law, no relaxation of it.
    ///
    /// Half of the points of a step are near and open. Those with a force, and those that are inside
    /// where the others have their forces, are solved for alone, until no point is inside that has none.
    ///
    /// Shapes: `warm` 3n forces to begin with, those of the last tick, N.
    pub fn solve(&self, warm: &[f64], budget: SolveBudget) -> Solution {
        let n = self.point_count();
        let mut lambda = match warm.len() == 3 * n {
            true => self.projected(warm),
            false => vec![0.0; 3 * n],
        };
        let mut motion = self.motion(&lambda);
        let mut is_in = vec![false; n];
        let (mut sweeps, mut newton_steps) = (0, 0);
        for _ in 0..ADDITIONS_MAX {
            let joins = |&i: &usize| lambda[3 * i] > 0.0 || motion[3 * i] < 0.0;
            let new: Vec<usize> = (0..n).filter(|&i| !is_in[i]).filter(joins).collect();
            if new.is_empty() {
                break;
            }
            new.into_iter().for_each(|i| is_in[i] = true);
            let set: Vec<usize> = (0..n).filter(|&i| is_in[i]).collect();
            let begin = set.iter().flat_map(|&i| <[f64; 3]>::from(at(&lambda, i))).collect();
            let found = self.of_points(&set).solve_whole(begin, budget);
            sweeps += found.sweeps;
            newton_steps += found.newton_steps;
            for (&i, force) in set.iter().zip(found.lambda.chunks_exact(3)) {
                lambda[3 * i..3 * i + 3].copy_from_slice(force);
            }
            motion = self.motion(&lambda);
            if !found.is_converged {
                break;
            }
        }
        let residual = self.residual_of(&lambda, &motion);
        if residual <= budget.allowed(&lambda) {
            return Solution { lambda, motion, residual, sweeps, newton_steps, is_converged: true };
        }
        let whole = self.solve_whole(lambda, budget);
        let (sweeps, newton_steps) = (sweeps + whole.sweeps, newton_steps + whole.newton_steps);
        Solution { sweeps, newton_steps, ..whole }
    }

    /// Contact problem of some points alone.
    fn of_points(&self, points: &[usize]) -> Self {
        let row = |k: usize| 3 * points[k / 3] + k % 3;
        let rows = 3 * points.len();
        Self {
            w: DMatrix::from_fn(rows, rows, |r, c| self.w[(row(r), row(c))]),
            b: (0..rows).map(|k| self.b[row(k)]).collect(),
            cones: points.iter().map(|&i| self.cones[i]).collect(),
            rho: points.iter().map(|&i| self.rho[i]).collect(),
        }
    }
}
