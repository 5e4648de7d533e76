//! The solution of a contact problem: of the points that press, or would be pressed into, and of all
//! points at once, by Newton's method with sweeps of a splitting where it strays.

use super::between_points::BetweenPoints;
use super::cone::{PointForce, at, chosen, put_back};
use super::forces::{Forces, Patience, SHARE_FIRST, SolveBudget, force_max};
use super::problem::ContactProblem;
use super::splitting::Splitting;

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
        let of_first = now.residual;
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
            let of_none = problem.residual_of(&vec![0.0; now.lambda.len()], &problem.b);
            let runaway = RUNAWAY * of_none.max(of_first);
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
