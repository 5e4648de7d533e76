//! One size in detail: every stage of a factor, of many right-hand sides and of a fresh process.

use super::request::{Files, Stages};
use super::round::{Problem, Round};
use super::several::Several;
use crate::programs::Programs;
use crate::report::ReportError;
use crate::sample::Spread;
use crate::table::{Cell, Table};

/// Number of requests of a fresh process, and of rounds of many right-hand sides.
const ROUNDS: usize = 5;

/// Rounds of one size: f64 on one thread and on all, then f32.
pub struct Rounds<'a> {
    pub doubles: [&'a [Round]; 2],
    pub singles: [&'a [Round]; 2],
}

/// Table of the times of each stage at this size.
///
/// Units: ms, except for the rates.
///
/// # Errors
/// [`ReportError`], also for a wrong answer.
pub fn table(problem: &Problem, rounds: &Rounds<'_>, is_quick: bool) -> Result<Table, ReportError> {
    let mut table = Table::new("limits", "One cube by stage", &COLUMNS);
    let mut row = |what: &str, of: Spread| {
        let values = [of.median, of.min, of.max].map(Cell::Number);
        table.push([Cell::Text(what.to_owned())].into_iter().chain(values));
    };
    let of = |rounds: &[Round], value: fn(&Round) -> f64| Spread::of(rounds.iter().map(value));
    let [double, doubles] = rounds.doubles;
    let [single, singles] = rounds.singles;
    row("product f64, one thread, GFlop/s", of(double, |r| r.product));
    row("product f32, one thread, GFlop/s", of(single, |r| r.product));
    row("product f64, all threads, GFlop/s", of(doubles, |r| r.product));
    row("order and analysis, all threads", of(doubles, |r| r.order));
    row("factor f64, one thread, first", of(double, |r| r.first));
    row("factor f64, one thread, again", of(double, |r| r.again));
    row("factor f64, all threads, first", of(doubles, |r| r.first));
    row("factor f64, all threads, again", of(doubles, |r| r.again));
    row("factor f32, one thread, again", of(single, |r| r.again));
    row("factor f32, all threads, again", of(singles, |r| r.again));
    row("solve f64, one right-hand side", of(doubles, |r| r.solve));
    row("solve f32, one right-hand side", of(singles, |r| r.solve));
    let several = Several::try_new(problem)?;
    let pairs = (0..if is_quick { 1 } else { ROUNDS })
        .map(|_| several.round(problem))
        .collect::<Result<Vec<_>, _>>()?;
    row("21 loads, front, refined", Spread::of(pairs.iter().map(|p| p[0])));
    row("21 loads, front-mixed, refined", Spread::of(pairs.iter().map(|p| p[1])));
    row("21 loads, front-mixed over front", Spread::of(pairs.iter().map(|p| p[1] / p[0])));
    if is_quick {
        return Ok(table);
    }
    let (programs, files) = (Programs::find()?, Files::of(problem)?);
    let mut told = Vec::new();
    let mut plain = Vec::new();
    for _ in 0..ROUNDS {
        told.push(files.solve(&programs, true)?);
        plain.push(files.solve(&programs, false)?);
    }
    let of = |stages: &[Stages], value: fn(&Stages) -> f64| Spread::of(stages.iter().map(value));
    row("a fresh process: assemble", of(&told, |s| s.assemble));
    row("a fresh process: order", of(&told, |s| s.order));
    row("a fresh process: factor", of(&told, |s| s.factor));
    row("a fresh process: solve", of(&told, |s| s.solve));
    row("a fresh process: solve, with --no-estimate", of(&plain, |s| s.solve));
    row("a fresh process: all four", of(&told, Stages::all));
    row("a fresh process: all four, with --no-estimate", of(&plain, Stages::all));
    Ok(table)
}

const COLUMNS: [&str; 4] = ["what", "median", "min", "max"];
