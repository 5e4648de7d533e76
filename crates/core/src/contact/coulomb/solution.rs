//! The solution of a contact problem, all points at once: Newton's method, with sweeps of a splitting where it strays.

use super::cone::PointForce;
use super::newton::Proximal;
use super::problem::{ContactProblem, at};
use super::splitting::Splitting;

/// How exactly and how long to solve.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SolveBudget {
    /// Residual of the natural map that is small enough, as a share of the largest force.
    pub residual_rel: f64,
    /// Residual that is small enough in any case, N.
    pub residual: f64,
    /// Most attempts, each of Newton's method and then of the splitting.
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
    /// Sweeps of the splitting that were made.
    pub sweeps: usize,
    /// Steps of Newton's method.
    pub newton_steps: usize,
    /// Whether the residual is within what was asked for.
    pub is_converged: bool,
}

/// Steps of Newton's method from one set of forces …
const NEWTON_STEPS: usize = 5;
/// … and how often it may go on from where it ended, in one attempt.
const NEWTON_ROUNDS: usize = 6;
/// Share of its own compliance that is added to a point for Newton's method, at first and at least.
const SHARE_FIRST: f64 = 1e-4;
const SHARE_MIN: f64 = 1e-6;
/// The share shrinks by this where Newton's method left so little of the residual.
const SHRINK: f64 = 0.3;
const LEFT_TO_SHRINK: f64 = 0.1;
/// Newton's method goes on where it solved its own problem and left no more of the residual than this …
const LEFT_IF_SOLVED: f64 = 0.7;
/// … or no more than this in any case.
const LEFT: f64 = 0.3;
/// Sweeps of the splitting after Newton's method has strayed, and the shares of compliance that they are
/// made with in turn: no single one suits far and near, and every system of points.
const SWEEPS: usize = 150;
const SPLITTING_SHARES: [f64; 3] = [1.0, 0.03, 0.005];
/// The first of these shares is left out where the residual is below this part of the largest force.
const NEAR: f64 = 0.1;
/// The splitting begins anew at what Newton's method found where that left no more than this.
const LEFT_TO_BEGIN_ANEW: f64 = 0.2;
/// Over the largest force, or a newton, a residual that is no approximation of anything.
const RUNAWAY: f64 = 10.0;

impl ContactProblem {
    /// The forces of all points at once, from some to begin with, each in its cone.
    ///
    /// Shapes: `lambda` 3n, N.
    pub(super) fn solve_whole(&self, lambda: Vec<f64>, budget: SolveBudget) -> Solution {
        let mut now = self.forces(lambda);
        let mut best = now.clone();
        let (mut sweeps, mut newton_steps, mut share) = (0, 0, SHARE_FIRST);
        let mut splitting: Option<Splitting<'_>> = None;
        let first = usize::from(now.residual < NEAR * force_max(&now.lambda));
        for turn in (first..).take(budget.attempts_max) {
            let before = now.residual;
            if !now.is_within(&budget) {
                newton_steps += self.newton(&mut now, &mut share, &budget);
            }
            if now.residual < best.residual {
                best.clone_from(&now);
            }
            if best.is_within(&budget) {
                break;
            }
            let mut begins_anew = now.residual < LEFT_TO_BEGIN_ANEW * before;
            // Friction can make the splitting run away: no descent is proven for it.
            let is_bounded = now.residual < force_max(&best.lambda).max(1.0) * RUNAWAY;
            if !is_bounded {
                now.clone_from(&best);
                begins_anew = true;
            }
            let of_turn = SPLITTING_SHARES[turn % SPLITTING_SHARES.len()];
            match &mut splitting {
                Some(splitting) => {
                    splitting.change_share(of_turn);
                    if begins_anew {
                        splitting.begin_at(&now.lambda);
                    }
                }
                None => splitting = Splitting::new(self, &now.lambda, of_turn),
            }
            let Some(splitting) = &mut splitting else { break };
            now = self.forces(splitting.advance(SWEEPS));
            sweeps += SWEEPS;
        }
        let is_converged = best.is_within(&budget);
        let motion = self.motion(&best.lambda);
        let Forces { lambda, residual } = best;
        Solution { lambda, motion, residual, sweeps, newton_steps, is_converged }
    }

    /// Newton's method from some forces, again and again while it pays; the number of its steps.
    fn newton(&self, now: &mut Forces, share: &mut f64, budget: &SolveBudget) -> usize {
        let (first, mut steps) = (now.residual, 0);
        for _ in 0..NEWTON_ROUNDS {
            let tolerance = 0.1 * now.allowed(budget);
            let found = Proximal::new(self, &now.lambda, *share).solve(NEWTON_STEPS, tolerance);
            steps += found.steps;
            let is_solved = found.residual <= tolerance;
            let next = self.forces(found.lambda);
            let left = next.residual / now.residual;
            if left < 1.0 {
                *now = next;
            }
            let pays = left < LEFT || is_solved && left < LEFT_IF_SOLVED;
            if !pays || now.is_within(budget) {
                break;
            }
            if now.residual < LEFT_TO_SHRINK * first {
                *share = (SHRINK * *share).max(SHARE_MIN);
            }
        }
        steps
    }

    fn forces(&self, lambda: Vec<f64>) -> Forces {
        let residual = self.residual_of(&lambda, &self.motion(&lambda));
        Forces { lambda, residual }
    }

    /// Every force moved into its cone.
    pub(super) fn projected(&self, lambda: &[f64]) -> Vec<f64> {
        let points = self.cones.iter().enumerate();
        points.flat_map(|(point, cone)| <[f64; 3]>::from(cone.project(at(lambda, point)))).collect()
    }
}

/// Forces of all points, 3n, and their residual of the natural map, N.
#[derive(Clone)]
struct Forces {
    lambda: Vec<f64>,
    residual: f64,
}

impl Forces {
    /// Residual that is small enough, N.
    fn allowed(&self, budget: &SolveBudget) -> f64 {
        budget.allowed(&self.lambda)
    }

    fn is_within(&self, budget: &SolveBudget) -> bool {
        self.residual <= self.allowed(budget)
    }
}

impl SolveBudget {
    /// Residual that is small enough for some forces, N.
    pub(super) fn allowed(&self, lambda: &[f64]) -> f64 {
        self.residual.max(self.residual_rel * force_max(lambda))
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
