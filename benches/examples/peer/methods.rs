//! Our methods on a whole problem: order, factor, one right-hand side, all of them.

use std::sync::Arc;
use std::time::Instant;

use softgrasp_bench::sample::timed_ms;
use softgrasp_core::solve::{Factored, FrontAnalysis, FrontFactor, Loads, Method, Stage};

use crate::problem::{COLUMNS, Problem};

/// Runs one method by its name through `Factored::solve`, refinement included; `bare-front` answers
/// through the factor alone, without refinement, as the peers do by default.
pub fn run(problem: &Problem, method: &str) -> anyhow::Result<serde_json::Value> {
    match method {
        "bare-front" => front(problem),
        other => factored(problem, other.parse()?),
    }
}

fn front(problem: &Problem) -> anyhow::Result<serde_json::Value> {
    let stiffness = problem.model.stiffness();
    let n = problem.partition.unknown().len();
    let (order_ms, analysis) =
        timed_ms(|| Arc::new(FrontAnalysis::new(stiffness, &problem.partition)));
    let (factor_ms, factor) = timed_ms(|| FrontFactor::<f64>::try_new(&analysis, stiffness));
    let factor = factor?;
    let mut answers = problem.b[..n].to_vec();
    let (solve_ms, ()) = timed_ms(|| factor.solve_in_place(&mut answers, 1));
    let mut wide = problem.b.clone();
    let (solve_wide_ms, ()) = timed_ms(|| factor.solve_in_place(&mut wide, COLUMNS));
    answers.extend(wide);
    problem.write_answers(&answers)?;
    Ok(times(order_ms, factor_ms, solve_ms, solve_wide_ms))
}

fn factored(problem: &Problem, method: Method) -> anyhow::Result<serde_json::Value> {
    let stiffness = problem.model.stiffness();
    let partition = problem.partition.clone();
    let start = Instant::now();
    let mut factor_began = start;
    let factored = Factored::try_new(stiffness, partition, method, &mut |stage| {
        if stage == Stage::Factor {
            factor_began = Instant::now();
        }
    })?;
    let factor_ms = factor_began.elapsed().as_secs_f64() * 1e3;
    let order_ms = (factor_began - start).as_secs_f64() * 1e3;
    let mut answers = Vec::new();
    let first = Loads { q_known: &problem.q_known[0], ..Loads::default() };
    let (solve_ms, solution) = timed_ms(|| factored.solve(stiffness, first, &mut |_| {}));
    answers.push(solution?.displacement);
    let loads: Vec<Loads<'_>> =
        problem.q_known.iter().map(|q_known| Loads { q_known, ..Loads::default() }).collect();
    let (solve_wide_ms, solutions) =
        timed_ms(|| factored.solve_several(stiffness, &loads, &mut |_| {}));
    answers.extend(solutions?.into_iter().map(|solution| solution.displacement));
    let unknown: Vec<f64> = answers.iter().flat_map(|u| problem.unknown_of(u)).collect();
    problem.write_answers(&unknown)?;
    Ok(times(order_ms, factor_ms, solve_ms, solve_wide_ms))
}

fn times(order_ms: f64, factor_ms: f64, solve_ms: f64, solve_wide_ms: f64) -> serde_json::Value {
    serde_json::json!({
        "order_ms": order_ms,
        "factor_ms": factor_ms,
        "solve_ms": solve_ms,
        "solve_wide_ms": solve_wide_ms,
    })
}
