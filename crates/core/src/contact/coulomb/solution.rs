//! The solution of a contact problem: of the points that press, or would be pressed into, and of all
//! points at once, by Newton's method with sweeps of a splitting where it strays.

use super::between_points::BetweenPoints;
use super::cone::{PointForce, at, chosen, put_back};
use super::newton::{NewtonLimits, Proximal};
use super::problem::ContactProblem;
use super::splitting::Splitting;

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

/// What a point does.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PointState {
    /// The point carries no force.
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

/// Times that points are added before all of them are solved for.
const ADDITIONS_MAX: usize = 8;
/// Share of its own compliance that is added to a point for Newton's method, at first, at least and at most.
const SHARE_FIRST: f64 = 1e-4;
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
/// Sweeps of the splitting after Newton's method has strayed, and the shares of compliance that they are
/// made with in turn: no single one suits far and near, and every system of points.
const SWEEPS: usize = 150;
/// Sweeps after which it is looked whether the forces are found.
const SWEEPS_TO_LOOK: usize = 25;
const SPLITTING_SHARES: [f64; 3] = [1.0, 0.1, 0.005];
/// The first of these shares is left out where the residual is below this part of the largest force.
const NEAR: f64 = 0.1;
/// The splitting begins anew at what Newton's method found where that left no more than this.
const LEFT_TO_BEGIN_ANEW: f64 = 0.2;
/// Shares of friction that are solved for one after the other where forces were not found: without friction
/// they are those of a convex problem.
const FRICTION_SHARES: [f64; 3] = [0.0, 0.3, 1.0];
/// Over the residual of the first forces and of none at all, one that is no approximation of anything.
const RUNAWAY: f64 = 10.0;

/// Forces of all points, 3n, N; their motions by them, 3n, m; and the residual of the natural map, N.
#[derive(Clone)]
struct Forces {
    lambda: Vec<f64>,
    motion: Vec<f64>,
    residual: f64,
}

impl Forces {
    fn new(problem: &ContactProblem, lambda: Vec<f64>) -> Self {
        let motion = problem.motion(&lambda);
        let residual = problem.residual_of(&lambda, &motion);
        Self { lambda, motion, residual }
    }

    /// Newton's method from some forces, again and again while it pays; the number of its steps.
    fn improve(
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
    fn allowed(&self, budget: &SolveBudget<'_>) -> f64 {
        budget.allowed(&self.lambda)
    }

    fn is_within(&self, budget: &SolveBudget<'_>) -> bool {
        self.residual <= self.allowed(budget)
    }
}

/// How long Newton's method goes on from some forces before the splitting is asked.
struct Patience {
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
    /// In all others: however slowly.
    const LATER: Self = Self { rounds: 20, rounds_to_look: 20, ..Self::SECOND };

    /// That of an attempt, counted from 0.
    fn of_attempt(attempt: usize) -> &'static Self {
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

impl SolveBudget<'_> {
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
    /// The forces that obey the law of Signorini and Coulomb: exactly that law, no relaxation of it.
    ///
    /// Half of the points of a step are near and open. Those with a force, and those that are inside
    /// where the others have their forces, are solved for alone, until no point is inside that has none.
    ///
    /// Shapes: `warm` 3n forces to begin with, those of the last tick, N.
    pub fn of(problem: &ContactProblem, warm: &[f64], budget: SolveBudget<'_>) -> Self {
        let n = problem.point_count();
        let mut lambda = match warm.len() == 3 * n {
            true => problem.projected(warm),
            false => vec![0.0; 3 * n],
        };
        let mut motion = problem.motion(&lambda);
        let mut is_in = vec![false; n];
        let (mut sweeps, mut newton_steps) = (0, 0);
        for _ in 0..ADDITIONS_MAX {
            let joins = |&i: &usize| {
                lambda[3 * i] > 0.0 || motion[3 * i] < 0.0 || problem.laws[i].is_spring()
            };
            let new: Vec<usize> = (0..n).filter(|&i| !is_in[i]).filter(joins).collect();
            if new.is_empty() {
                break;
            }
            new.into_iter().for_each(|i| is_in[i] = true);
            let set: Vec<usize> = (0..n).filter(|&i| is_in[i]).collect();
            let found = Self::of_all(&problem.of_points(&set), chosen(&lambda, &set), budget);
            sweeps += found.sweeps;
            newton_steps += found.newton_steps;
            put_back(&found.lambda, &set, &mut lambda);
            motion = problem.motion(&lambda);
            if !found.is_converged {
                break;
            }
        }
        let residual = problem.residual_of(&lambda, &motion);
        let is_converged = residual <= budget.allowed(&lambda);
        if is_converged || (budget.is_late)() {
            return Self { lambda, motion, residual, sweeps, newton_steps, is_converged };
        }
        let whole = Self::of_all(problem, lambda, budget);
        let (sweeps, newton_steps) = (sweeps + whole.sweeps, newton_steps + whole.newton_steps);
        Self { sweeps, newton_steps, ..whole }
    }

    /// The forces of all points at once, from some to begin with: between the points alone where those are fewer
    /// than the corners.
    ///
    /// Shapes: `lambda` 3n, N.
    fn of_all(problem: &ContactProblem, lambda: Vec<f64>, budget: SolveBudget<'_>) -> Self {
        let Some(between) = BetweenPoints::new(problem) else {
            return Self::of_whole(problem, lambda, budget);
        };
        let found = Self::of_whole(between.problem(), between.of_points(&lambda), budget);
        let forces = Forces::new(problem, between.with_springs(&found.lambda));
        let told = Self::told(forces, (found.sweeps, found.newton_steps), &budget);
        if told.is_converged || !found.is_converged {
            return told;
        }
        // Digits were lost with the springs.
        let whole = Self::of_whole(problem, told.lambda, budget);
        let sweeps = told.sweeps + whole.sweeps;
        Self { sweeps, newton_steps: told.newton_steps + whole.newton_steps, ..whole }
    }

    /// Forces that were found, by so many sweeps and steps of Newton's method.
    fn told(
        forces: Forces,
        (sweeps, newton_steps): (usize, usize),
        budget: &SolveBudget<'_>,
    ) -> Self {
        let is_converged = forces.is_within(budget);
        let Forces { lambda, motion, residual } = forces;
        Self { lambda, motion, residual, sweeps, newton_steps, is_converged }
    }

    /// The forces of all points at once, from some to begin with, each in its cone; where they are not found
    /// from there, from those of less friction.
    ///
    /// Shapes: `lambda` 3n, N.
    fn of_whole(problem: &ContactProblem, lambda: Vec<f64>, budget: SolveBudget<'_>) -> Self {
        let mut best = Self::from_forces(problem, lambda, budget);
        if best.is_converged || (budget.is_late)() {
            return best;
        }
        let (mut sweeps, mut newton_steps) = (best.sweeps, best.newton_steps);
        let mut lambda = best.lambda.clone();
        for share in FRICTION_SHARES {
            let eased = problem.with_friction(share);
            let found = Self::from_forces(&eased, eased.projected(&lambda), budget);
            sweeps += found.sweeps;
            newton_steps += found.newton_steps;
            lambda.clone_from(&found.lambda);
            if share == 1.0 && found.residual < best.residual {
                best = found;
            }
        }
        Self { sweeps, newton_steps, ..best }
    }

    /// The forces of all points at once, from some to begin with, each in its cone.
    ///
    /// Shapes: `lambda` 3n, N.
    fn from_forces(problem: &ContactProblem, lambda: Vec<f64>, budget: SolveBudget<'_>) -> Self {
        let mut now = Forces::new(problem, lambda);
        let mut best = now.clone();
        let (mut sweeps, mut newton_steps, mut share) = (0, 0, SHARE_FIRST);
        let mut splitting: Option<Splitting<'_>> = None;
        let of_none = problem.residual_of(&vec![0.0; now.lambda.len()], &problem.b);
        let runaway = RUNAWAY * of_none.max(now.residual);
        let first = usize::from(now.residual < NEAR * force_max(&now.lambda));
        for turn in (first..).take(budget.attempts_max) {
            let before = now.residual;
            if !now.is_within(&budget) {
                let patience = Patience::of_attempt(turn - first);
                newton_steps += now.improve(problem, patience, &mut share, &budget);
            }
            if now.residual < best.residual {
                best.clone_from(&now);
            }
            if best.is_within(&budget) || (budget.is_late)() {
                break;
            }
            let of_turn = SPLITTING_SHARES[turn % SPLITTING_SHARES.len()];
            match &mut splitting {
                Some(splitting) => {
                    splitting.change_share(of_turn);
                    if now.residual < LEFT_TO_BEGIN_ANEW * before {
                        splitting.begin_at(&now.lambda, &now.motion);
                    }
                }
                None => splitting = Splitting::new(problem, (&now.lambda, &now.motion), of_turn),
            }
            let Some(splitting) = &mut splitting else { break };
            for _ in 0..SWEEPS / SWEEPS_TO_LOOK {
                now = Forces::new(problem, splitting.advance(SWEEPS_TO_LOOK));
                sweeps += SWEEPS_TO_LOOK;
                // Friction can make the splitting run away: no descent is proven for it.
                if now.residual > runaway {
                    now.clone_from(&best);
                    splitting.begin_at(&now.lambda, &now.motion);
                    break;
                }
                if now.residual <= 0.1 * now.allowed(&budget) || (budget.is_late)() {
                    break;
                }
            }
        }
        // Those of the last sweeps have not been compared yet.
        if now.residual < best.residual {
            best = now;
        }
        Self::told(best, (sweeps, newton_steps), &budget)
    }

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
