//! The solution of a contact problem: sweeps until it is clear who sticks, then Newton's method.

use super::cone::PointForce;
use super::newton;
use super::problem::{ContactProblem, at};
use super::sweeps::Sweeps;

/// How exactly and how long to solve.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SolveBudget {
    /// Residual of the natural map that is small enough, as a share of the largest force.
    pub residual_rel: f64,
    /// Residual that is small enough in any case, N.
    pub residual: f64,
    /// Most sweeps over all points.
    pub sweeps_max: usize,
}

impl Default for SolveBudget {
    fn default() -> Self {
        Self { residual_rel: 1e-10, residual: 0.0, sweeps_max: 2000 }
    }
}

/// What a point does.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PointState {
    /// No force.
    Open,
    /// Force within the cone.
    Sticking,
    /// Force on the cone, opposite to the slip.
    Slipping,
}

/// Forces of all points, and how well they obey the law.
#[derive(Clone, Debug, PartialEq)]
pub struct Solution {
    /// Force of every point along its normal and its two tangents, 3n, N.
    pub lambda: Vec<f64>,
    /// Gap and slip of every point, 3n, m.
    pub motion: Vec<f64>,
    /// Largest residual of the natural map, N.
    pub residual: f64,
    /// Sweeps that were made.
    pub sweeps: usize,
    /// Steps of Newton's method that were kept.
    pub newton_steps: usize,
    /// Whether the residual is within what was asked for.
    pub is_converged: bool,
}

/// Sweeps before the first step of Newton's method, and between two attempts.
const SWEEPS_BETWEEN: usize = 6;
/// Steps of Newton's method in one attempt.
const NEWTON_STEPS: usize = 6;

impl ContactProblem {
    /// The forces that obey the law of Signorini and Coulomb: exactly that law, no relaxation of it.
    ///
    /// Shapes: `warm` 3n forces to begin with, those of the last tick, N.
    pub fn solve(&self, warm: &[f64], budget: SolveBudget) -> Solution {
        let n = self.point_count();
        let mut lambda: Vec<f64> = Vec::with_capacity(3 * n);
        for point in 0..n {
            let force = if warm.len() == 3 * n { at(warm, point) } else { PointForce::zeros() };
            lambda.extend(self.cones[point].project(force).iter());
        }
        let motion = self.motion(&lambda);
        let residual = self.residual_of(&lambda, &motion);
        let mut found = Solution {
            lambda,
            motion,
            residual,
            sweeps: 0,
            newton_steps: 0,
            is_converged: false,
        };
        let sweeps = Sweeps::new(self);
        while !found.is_small_enough(budget) && found.sweeps < budget.sweeps_max {
            for _ in 0..SWEEPS_BETWEEN {
                sweeps.sweep(&mut found.lambda, &mut found.motion);
                found.sweeps += 1;
            }
            // Summed anew, so that no rounding of the sweeps stays.
            found.motion = self.motion(&found.lambda);
            found.residual = self.residual_of(&found.lambda, &found.motion);
            for _ in 0..NEWTON_STEPS {
                if found.is_small_enough(budget) || !self.take_newton_step(&mut found) {
                    break;
                }
            }
        }
        found.is_converged = found.is_small_enough(budget);
        found
    }

    /// Takes a step of Newton's method, or a part of it, if that brings the forces nearer to the law.
    fn take_newton_step(&self, found: &mut Solution) -> bool {
        let Some(full) = newton::step(self, &found.lambda, &found.motion) else { return false };
        for share in [1.0, 0.5, 0.25] {
            let part = found.lambda.iter().zip(&full).map(|(old, new)| old + share * (new - old));
            let mut next: Vec<f64> = part.collect();
            for (point, cone) in self.cones.iter().enumerate() {
                let force = cone.project(at(&next, point));
                next[3 * point..3 * point + 3].copy_from_slice(force.as_slice());
            }
            let motion = self.motion(&next);
            let residual = self.residual_of(&next, &motion);
            // Written so that a NaN is refused too.
            let is_better = residual < found.residual;
            if is_better {
                (found.lambda, found.motion, found.residual) = (next, motion, residual);
                found.newton_steps += 1;
                return true;
            }
        }
        false
    }
}

/// What a point with some force does under some friction.
pub fn state_of(force: &PointForce, friction: f64) -> PointState {
    match (force.x > 0.0, force.yz().norm() < friction * force.x * (1.0 - 1e-9)) {
        (false, _) => PointState::Open,
        (true, true) => PointState::Sticking,
        (true, false) => PointState::Slipping,
    }
}

impl Solution {
    /// Largest force of a point, N.
    pub fn force_max(&self) -> f64 {
        let points = 0..self.lambda.len() / 3;
        points.map(|point| at(&self.lambda, point).norm()).fold(0.0, f64::max)
    }

    /// Force of a point along its normal and its tangents, N.
    pub fn force(&self, point: usize) -> PointForce {
        at(&self.lambda, point)
    }

    fn is_small_enough(&self, budget: SolveBudget) -> bool {
        self.residual <= budget.residual.max(budget.residual_rel * self.force_max())
    }
}
