//! One load case of a partition, answered by a factor and refinement, or by conjugate gradients.

use super::block::Block;
use super::error::SolveError;
use super::kernel::Kernel;
use super::refinement::{Judged, RESIDUAL_GOOD, refine};
use super::solution::{Loads, Solution, System};
use crate::solve::Method;
use crate::solve::certainty::backward_error;
use crate::solve::multigrid::{self, Goal, Hierarchy, Outcome, TOGETHER};
use crate::solve::pcg::{self, PcgOutcome, PcgParams};
use crate::solve::rates::ERROR_ITERATED;
use crate::solve::vectors::{norm, subtract};

/// Refinement stops a little short of its goal where rounding does; that far short is as good.
pub(super) const SHORT_OF_GOAL: f64 = 10.0;
/// Conjugate gradients with a single-precision factor stop after this many steps in any case.
const PCG_STEPS_MAX: u32 = 500;
/// Relative residual that conjugate gradients with a hierarchy reach where nothing else is asked for.
const RESIDUAL_ITERATED: f64 = 1e-12;
/// Conjugate gradients with a hierarchy stop after this many steps in any case.
const STEPS_MAX: u32 = 1000;
/// Where rounding ends the steps, an answer with an estimated error this far above the goal is given,
/// and says so.
const SHORT_OF_ITERATED_GOAL: f64 = 100.0;

/// The answer by a factor, an inverse or a hierarchy, and whether refinement came to its goal.
///
/// # Errors
/// [`SolveError::NotFinite`], and [`SolveError::NotConverged`] by a hierarchy.
pub(super) fn solve(
    system: System<'_>,
    kernel: &Kernel,
    loads: Loads<'_>,
) -> Result<(Solution, bool), SolveError> {
    if let Kernel::Multigrid(hierarchy) = kernel {
        let mut found = solve_by_cycles(system, hierarchy, &[loads]);
        return found.pop().expect("as many answers as loads").map(|solution| (solution, true));
    }
    let is_single = kernel.is_single();
    let stops_early = is_single && system.method == Method::Pcg;
    let goal = RESIDUAL_GOOD.max(loads.residual_rel);
    if is_single && !stops_early {
        let found = Block::solve(system, kernel, &[loads]).pop();
        if let Some(solution) = found.flatten().filter(|found| found.residual_rel <= goal) {
            return Ok((solution, true));
        }
    }
    let System { stiffness, partition, .. } = system;
    let b = system.right_hand_side(loads);
    let b_norm = norm(&b);
    let mut q = system.prescribed(loads);
    let mut x = if stops_early { vec![0.0; b.len()] } else { kernel.apply(b.clone()) };
    let apply = |x: &[f64]| system.apply_k11(x);
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
        let (reached, is_near) = solve_by_pcg((system, kernel), &b, (goal, loads), &mut x);
        residual = reached.residual;
        refinement_steps += reached.steps;
        error_estimate_rel = Some(reached.error_estimate_rel);
        judged = None;
        is_right &= is_near;
    }
    let Judged { backward_error, .. } = judged.unwrap_or_else(|| judge(&x, &residual));
    // What was judged last need not be what was taken.
    partition.scatter_unknown(&x, &mut q);
    system.check_finite(&q)?;
    let solution = Solution {
        reaction: system.reactions(&q, loads.forces),
        displacement: q,
        residual_rel: if b_norm > 0.0 { norm(&residual) / b_norm } else { norm(&residual) },
        backward_error,
        error_estimate_rel,
        refinement_steps,
        fallback: system.fallback,
    };
    Ok((solution, is_right))
}

/// Improves `x` by conjugate gradients that a single-precision factor preconditions, to a relative
/// residual; whether they came to their goal, or nearly so.
fn solve_by_pcg(
    (system, kernel): (System<'_>, &Kernel),
    b: &[f64],
    (residual_rel, loads): (f64, Loads<'_>),
    x: &mut [f64],
) -> (PcgOutcome, bool) {
    // Without an error to reach the residual decides alone.
    let error_rel = Some(loads.residual_rel).filter(|e| *e > 0.0).unwrap_or(f64::INFINITY);
    let params = PcgParams { residual_rel, error_rel, steps_max: PCG_STEPS_MAX };
    let precondition = |r: &[f64]| kernel.apply(r.to_vec());
    let reached = pcg::solve(&|x| system.apply_k11(x), &precondition, b, x, params);
    let is_near = norm(&reached.residual) <= SHORT_OF_GOAL * residual_rel * norm(b)
        && reached.error_estimate_rel <= SHORT_OF_GOAL * error_rel;
    (reached, is_near)
}

/// Answers by conjugate gradients that a hierarchy preconditions, in the order of the loads.
///
/// # Errors
/// For each load [`SolveError::NotFinite`], [`SolveError::NotConverged`].
pub(super) fn solve_by_cycles(
    system: System<'_>,
    hierarchy: &Hierarchy,
    loads: &[Loads<'_>],
) -> Vec<Result<Solution, SolveError>> {
    let System { stiffness, partition, .. } = system;
    let of_some = |some: &[Loads<'_>]| -> Vec<_> {
        let posed = |loads: &Loads<'_>| {
            let mut b = vec![0.0; partition.dof_count()];
            partition.scatter_unknown(&system.right_hand_side(*loads), &mut b);
            (b, goal_of(*loads))
        };
        let asked: Vec<(Vec<f64>, Goal)> = some.iter().map(posed).collect();
        let found = multigrid::solve(stiffness, partition, hierarchy, &asked);
        drop(asked);
        found.into_iter().zip(some).map(|(found, loads)| answer(system, *loads, found)).collect()
    };
    // No more right-hand sides are there at once than are worked on.
    loads.chunks(TOGETHER).flat_map(of_some).collect()
}

/// How far steps by a hierarchy go.
fn goal_of(loads: Loads<'_>) -> Goal {
    let (residual_rel, error_rel) = match loads.residual_rel > 0.0 {
        true => (loads.residual_rel.max(RESIDUAL_ITERATED), loads.residual_rel.max(ERROR_ITERATED)),
        false => (RESIDUAL_ITERATED, ERROR_ITERATED),
    };
    Goal { residual_rel, error_rel, steps_max: STEPS_MAX }
}

/// The answer that steps by a hierarchy found, if it is one.
fn answer(system: System<'_>, loads: Loads<'_>, found: Outcome) -> Result<Solution, SolveError> {
    let System { stiffness, partition, method, .. } = system;
    let error_rel = goal_of(loads).error_rel;
    let mut q = found.x;
    system.prescribe(loads, &mut q);
    system.check_finite(&q)?;
    let error_estimate_rel = found.error_estimate_rel;
    // A NaN is no answer either.
    let is_answer = error_estimate_rel <= SHORT_OF_ITERATED_GOAL * error_rel;
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
    Ok(Solution {
        reaction: system.reactions(&q, loads.forces),
        backward_error: backward_error(stiffness, partition, &q, &residual, loads.forces),
        displacement: q,
        residual_rel: found.residual_rel,
        error_estimate_rel: Some(error_estimate_rel),
        refinement_steps: found.steps,
        fallback: system.fallback,
    })
}
