//! One size in detail: what was measured before the factor was worked on, and what is now.

use super::request::{Files, Stages};
use super::round::{Problem, Round};
use super::several::Several;
use crate::programs::Programs;
use crate::report::ReportError;
use crate::sample::Spread;
use crate::table::{Cell, Table};

/// Requests of a fresh process, and rounds of many right-hand sides.
const ROUNDS: usize = 5;

/// Rounds of the size in question: f64 on one thread and on all, f32 the same.
pub struct Rounds<'a> {
    pub doubles: [&'a [Round]; 2],
    pub singles: [&'a [Round]; 2],
}

/// Each stage of this size, as it was and as it is.
///
/// Units: ms, but for the rates.
///
/// # Errors
/// [`ReportError`]; an answer that is wrong is one.
pub fn table(problem: &Problem, rounds: &Rounds<'_>, is_quick: bool) -> Result<Table, ReportError> {
    let mut table = Table::new("limits", "Before and after", &COLUMNS);
    let mut row = |what: &str, before: &str, of: Spread, other: &str| {
        let text = |text: &str| Cell::Text(text.to_owned());
        let after = [of.median, of.min, of.max].map(Cell::Number);
        table.push([text(what), text(before)].into_iter().chain(after).chain([text(other)]));
    };
    let of = |rounds: &[Round], value: fn(&Round) -> f64| Spread::of(rounds.iter().map(value));
    let [double, doubles] = rounds.doubles;
    let [single, singles] = rounds.singles;
    row("product f64, one thread, GFlop/s", "75 to 82", of(double, |r| r.product), "MKL 85 to 96");
    row(
        "product f32, one thread, GFlop/s",
        "164 to 171",
        of(single, |r| r.product),
        "MKL 165 to 185",
    );
    row("product f64, all threads, GFlop/s", "", of(doubles, |r| r.product), "");
    row(
        "order and analysis, all threads",
        "45",
        of(doubles, |r| r.order),
        "Pardiso 82, CHOLMOD 111",
    );
    row("factor f64, one thread, first", "373 to 391", of(double, |r| r.first), "");
    row("factor f64, one thread, again", "", of(double, |r| r.again), "");
    row("factor f64, all threads, first", "242 to 258", of(doubles, |r| r.first), "Pardiso 234");
    row("factor f64, all threads, again", "198 to 205", of(doubles, |r| r.again), "");
    row("factor f32, one thread, again", "190", of(single, |r| r.again), "");
    row("factor f32, all threads, again", "104", of(singles, |r| r.again), "");
    row(
        "solve f64, one right-hand side",
        "17",
        of(doubles, |r| r.solve),
        "CHOLMOD 15 to 17, Pardiso 30",
    );
    row("solve f32, one right-hand side", "9", of(singles, |r| r.solve), "");
    let several = Several::try_new(problem)?;
    let pairs = (0..if is_quick { 1 } else { ROUNDS })
        .map(|_| several.round(problem))
        .collect::<Result<Vec<_>, _>>()?;
    row("21 loads, front, refined", "", Spread::of(pairs.iter().map(|p| p[0])), "");
    row("21 loads, front-mixed, refined", "1000", Spread::of(pairs.iter().map(|p| p[1])), "");
    row("the same, over front", "", Spread::of(pairs.iter().map(|p| p[1] / p[0])), "");
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
    row("a fresh process: assemble", "44", of(&told, |s| s.assemble), "");
    row("a fresh process: order", "45", of(&told, |s| s.order), "");
    row("a fresh process: factor", "313", of(&told, |s| s.factor), "");
    row("a fresh process: solve", "87", of(&told, |s| s.solve), "");
    row("the same with --no-estimate", "", of(&plain, |s| s.solve), "");
    row("a fresh process: all four", "489", of(&told, Stages::all), "Pardiso without assembly 346");
    row("the same with --no-estimate", "", of(&plain, Stages::all), "");
    Ok(table)
}

impl Stages {
    fn all(&self) -> f64 {
        self.assemble + self.order + self.factor + self.solve
    }
}

const COLUMNS: [&str; 6] = ["what", "before", "after", "after_min", "after_max", "others_then"];
