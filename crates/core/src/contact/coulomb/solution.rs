//! The solution of a contact problem: Newton's method, with sweeps over the points where it strays.

use super::cone::PointForce;
use super::newton::Proximal;
use super::problem::{ContactProblem, at};
use super::sweeps::Sweeps;

/// How exactly and how long to solve.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SolveBudget {
    /// Residual of the natural map that is small enough, as a share of the largest force.
    pub residual_rel: f64,
    /// Residual that is small enough in any case, N.
    pub residual: f64,
    /// Most attempts of Newton's method.
    pub attempts_max: usize,
}

impl Default for SolveBudget {
    fn default() -> Self {
        Self { residual_rel: 1e-10, residual: 0.0, attempts_max: 40 }
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
    /// Steps of Newton's method.
    pub newton_steps: usize,
    /// Whether the residual is within what was asked for.
    pub is_converged: bool,
}

/// Steps of Newton's method in one attempt.
const NEWTON_STEPS: usize = 8;
/// Sweeps after an attempt that failed: so many at a time …
const SWEEPS: usize = 10;
/// … as long as a batch leaves no more than this share of the residual, and no more batches than these.
const PAYS: f64 = 0.7;
const BATCHES: usize = 10;
/// Share of its own compliance that is added to a point in the first attempt, and its limits.
const SHARE_FIRST: f64 = 1e-4;
const SHARE_MIN: f64 = 1e-7;
const SHARE_MAX: f64 = 0.1;
/// The share shrinks after an attempt that succeeded, and grows after one that failed.
const SHRINK: f64 = 0.1;
const GROW: f64 = 10.0;
/// An attempt has succeeded if it leaves so little of the residual …
const SUCCESS: f64 = 0.3;
/// … or if it solves its own problem so much better than that.
const OWN_SUCCESS: f64 = 1e-3;

impl ContactProblem {
    /// The forces that obey the law of Signorini and Coulomb: exactly that law, no relaxation of it.
    ///
    /// Shapes: `warm` 3n forces to begin with, those of the last tick, N.
    pub fn solve(&self, warm: &[f64], budget: SolveBudget) -> Solution {
        let n = self.point_count();
        let mut lambda = match warm.len() == 3 * n {
            true => self.projected(warm),
            false => vec![0.0; 3 * n],
        };
        let mut residual = self.residual_of(&lambda, &self.motion(&lambda));
        let mut best = (residual, lambda.clone());
        let (mut sweeps, mut newton_steps) = (0, 0);
        let mut sweeper = None;
        let mut share = SHARE_FIRST;
        let is_small = |residual: f64, lambda: &[f64]| {
            residual <= budget.residual.max(budget.residual_rel * force_max(lambda))
        };
        for _ in 0..budget.attempts_max {
            if is_small(residual, &lambda) {
                break;
            }
            let allowed = budget.residual.max(budget.residual_rel * force_max(&lambda));
            let found = Proximal::new(self, &lambda, share).solve(NEWTON_STEPS, 0.1 * allowed);
            newton_steps += found.steps;
            let now = self.residual_of(&found.lambda, &self.motion(&found.lambda));
            let own_limit = (0.1 * allowed).max(OWN_SUCCESS * residual);
            if found.residual <= own_limit || now < SUCCESS * residual {
                (lambda, residual) = (found.lambda, now);
                share = (SHRINK * share).max(SHARE_MIN);
            } else {
                share = (GROW * share).min(SHARE_MAX);
                if now < residual {
                    lambda = found.lambda;
                }
                let mut motion = self.motion(&lambda);
                residual = self.residual_of(&lambda, &motion);
                let sweeper = sweeper.get_or_insert_with(|| Sweeps::new(self));
                for _ in 0..BATCHES {
                    (0..SWEEPS).for_each(|_| sweeper.sweep(&mut lambda, &mut motion));
                    sweeps += SWEEPS;
                    let before =
                        std::mem::replace(&mut residual, self.residual_of(&lambda, &motion));
                    if is_small(residual, &lambda) || residual > PAYS * before {
                        break;
                    }
                }
            }
            if residual < best.0 {
                best = (residual, lambda.clone());
            }
        }
        let (residual, lambda) = best;
        let motion = self.motion(&lambda);
        let is_converged = is_small(residual, &lambda);
        Solution { lambda, motion, residual, sweeps, newton_steps, is_converged }
    }

    /// Every force moved into its cone.
    pub(super) fn projected(&self, lambda: &[f64]) -> Vec<f64> {
        let points = self.cones.iter().enumerate();
        points.flat_map(|(point, cone)| <[f64; 3]>::from(cone.project(at(lambda, point)))).collect()
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
        force_max(&self.lambda)
    }

    /// Force of a point along its normal and its tangents, N.
    pub fn force(&self, point: usize) -> PointForce {
        at(&self.lambda, point)
    }
}

fn force_max(lambda: &[f64]) -> f64 {
    lambda.chunks_exact(3).map(|f| f[0].hypot(f[1]).hypot(f[2])).fold(0.0, f64::max)
}
