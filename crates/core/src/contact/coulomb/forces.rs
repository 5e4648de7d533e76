//! The forces of a contact problem on the way to its solution: Newton's method makes them better, for as long as it
//! goes on fast enough.

use super::newton::{NewtonLimits, Proximal};
use super::problem::ContactProblem;

/// How exactly and how long to solve.
#[derive(Clone, Copy)]
pub struct SolveBudget<'a> {
    /// Residual of the natural map that is small enough, as a share of the largest force.
    pub residual_rel: f64,
    /// Residual that is small enough in any case, N.
    pub residual: f64,
    /// Most attempts, each of Newton's method and then of the splitting.
    pub attempts_max: usize,
    /// Asked between steps of Newton's method and among the sweeps: whether the best forces so far will do.
    pub is_late: &'a (dyn Fn() -> bool + Sync),
}

impl Default for SolveBudget<'_> {
    fn default() -> Self {
        Self { residual_rel: 1e-10, residual: 0.0, attempts_max: 40, is_late: &|| false }
    }
}

impl SolveBudget<'_> {
    /// Residual that is small enough for some forces, N.
    pub(super) fn allowed(&self, lambda: &[f64]) -> f64 {
        self.residual.max(self.residual_rel * force_max(lambda))
    }
}

/// Share of its own compliance that is added to a point for Newton's method, at first, at least and at most.
pub(super) const SHARE_FIRST: f64 = 1e-4;
const SHARE_MIN: f64 = 1e-6;
const SHARE_MAX: f64 = 1.0;
/// The share shrinks by this …
const SHRINK: f64 = 0.3;
/// … or grows by this: with more compliance Newton's method strays less.
const GROW: f64 = 3.5;
/// In the first attempt the share shrinks where this much of the residual is left.
const LEFT_TO_SHRINK: f64 = 0.1;
/// Newton's method went well where it left no more of the residual than this.
const LEFT: f64 = 0.3;
/// After some rounds no more than this part of the residual may be left: slow ones are the splitting's.
const LEFT_TO_GO_ON: f64 = 0.5;
/// In later attempts the solution of a problem with compliance added is taken although it leaves so many times the
/// residual: forces come nearer with every one (Rockafellar 1976), the residual need not.
const GROWN: f64 = 10.0;
/// Its own problem solved, it pays to go on where no more than this is left.
const LEFT_IF_SOLVED: f64 = 0.7;

/// Forces of all points, 3n, N; their motions by them, 3n, m; and the residual of the natural map, N.
#[derive(Clone)]
pub(super) struct Forces {
    pub lambda: Vec<f64>,
    pub motion: Vec<f64>,
    pub residual: f64,
}

impl Forces {
    pub fn new(problem: &ContactProblem, lambda: Vec<f64>) -> Self {
        let motion = problem.motion(&lambda);
        let residual = problem.residual_of(&lambda, &motion);
        Self { lambda, motion, residual }
    }

    /// Newton's method from some forces, again and again while it pays; the number of its steps.
    pub fn improve(
        &mut self,
        problem: &ContactProblem,
        patience: &Patience,
        share: &mut f64,
        budget: &SolveBudget<'_>,
    ) -> usize {
        let (first, mut steps) = (self.residual, 0);
        let mut looked_at = first;
        for round in 0..patience.rounds {
            if round > 0 && round % patience.rounds_to_look == 0 {
                if self.residual > LEFT_TO_GO_ON * looked_at {
                    break;
                }
                looked_at = self.residual;
            }
            let tolerance = 0.1 * self.allowed(budget);
            let proximal = Proximal::new(problem, &self.lambda, *share);
            let found = proximal.solve(&patience.newton, tolerance, budget.is_late);
            steps += found.steps;
            let is_solved = found.residual <= tolerance;
            let next = Self::new(problem, found.lambda);
            let left = next.residual / self.residual;
            if left < 1.0 || patience.adapts_share && is_solved && left < GROWN {
                *self = next;
            }
            if self.is_within(budget) || (budget.is_late)() {
                break;
            }
            let far = self.residual / first;
            match patience.next_share(*share, is_solved, (left, far)) {
                Some(next) => *share = next,
                None => break,
            }
        }
        steps
    }

    /// Residual that is small enough, N.
    pub fn allowed(&self, budget: &SolveBudget<'_>) -> f64 {
        budget.allowed(&self.lambda)
    }

    pub fn is_within(&self, budget: &SolveBudget<'_>) -> bool {
        self.residual <= self.allowed(budget)
    }
}

/// How long Newton's method goes on from some forces before the splitting is asked.
pub(super) struct Patience {
    /// Problems with compliance added that are solved one after another …
    rounds: usize,
    /// … and after how many of them it is looked whether they go on fast enough.
    rounds_to_look: usize,
    newton: NewtonLimits,
    /// Whether more compliance is added where Newton's method strayed, and less wherever it went well.
    adapts_share: bool,
}

impl Patience {
    /// In the first attempt: a few steps find what is near, and where many points are far from their forces the
    /// sweeps of the splitting cost less than more steps.
    const FIRST: Self = Self {
        rounds: 6,
        rounds_to_look: 6,
        newton: NewtonLimits { steps: 5, straying: 4, runaway: 30.0 },
        adapts_share: false,
    };
    /// In the next two: Newton's method and the splitting must not come back to the forces of the attempt before.
    const SECOND: Self = Self {
        rounds: 12,
        rounds_to_look: 4,
        newton: NewtonLimits { steps: 6, straying: 5, runaway: 1e4 },
        adapts_share: true,
    };
    /// In all that follow: Newton's method is not ended for going slowly.
    const LATER: Self = Self { rounds: 20, rounds_to_look: 20, ..Self::SECOND };

    /// That of an attempt, counted from 0.
    pub fn of_attempt(attempt: usize) -> &'static Self {
        match attempt {
            0 => &Self::FIRST,
            1 | 2 => &Self::SECOND,
            _ => &Self::LATER,
        }
    }

    /// The share of compliance to go on with; `None` where it does not pay to go on. `left` is the part of the
    /// residual that the last round left, `far` that of all rounds.
    fn next_share(&self, share: f64, is_solved: bool, (left, far): (f64, f64)) -> Option<f64> {
        let less = (SHRINK * share).max(SHARE_MIN);
        let pays = left < LEFT || is_solved && left < LEFT_IF_SOLVED;
        if !self.adapts_share {
            return pays.then_some(if far < LEFT_TO_SHRINK { less } else { share });
        }
        match is_solved || left < LEFT {
            true => (pays || share > SHARE_MIN).then_some(less),
            false => (share < SHARE_MAX).then_some((GROW * share).min(SHARE_MAX)),
        }
    }
}

/// Largest force of a point, N.
///
/// Shapes: `lambda` 3n.
pub(super) fn force_max(lambda: &[f64]) -> f64 {
    lambda.chunks_exact(3).map(|f| f[0].hypot(f[1]).hypot(f[2])).fold(0.0, f64::max)
}
