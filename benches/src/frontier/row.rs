//! One row: an object, its element, a method, and whether another row beats it.

use super::contest::Outcome;
use super::pareto::marks;
use super::system::Discretisation;
use crate::table::{Cell, Table};

/// Times and errors of one method on one system of one object, and whether other rows beat it.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Row {
    pub object: String,
    pub discretisation: Discretisation,
    pub system_nodes: usize,
    pub unknown_dofs: usize,
    pub outcome: Outcome,
    pub best: Best,
}

/// Comparisons in which no other row beats this one.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Best {
    /// Time of a warm frame against the algebraic error.
    pub warm_algebraic: bool,
    /// Time of a warm frame against the error of mesh, element and arithmetic together.
    pub warm_total: bool,
    /// Time of a cold start against the algebraic error.
    pub cold_algebraic: bool,
    /// Time of a cold start against the error of mesh, element and arithmetic together.
    pub cold_total: bool,
}

/// Factor within which algebraic errors count as equal, since another order of summation changes them.
const SAME_ALGEBRAIC: f64 = 10.0;
/// Factor within which total errors count as those of the same mesh and element.
const SAME_TOTAL: f64 = 1.01;

/// Marks the rows of one object: algebraic errors among equal systems, total ones among all.
pub(super) fn mark(rows: &mut [Row]) {
    for discretisation in Discretisation::ALL {
        let mut same: Vec<&mut Row> =
            rows.iter_mut().filter(|r| r.discretisation == discretisation).collect();
        let of = |time: fn(&Outcome) -> f64, same: &[&mut Row]| -> Vec<bool> {
            let answers: Vec<_> =
                same.iter().map(|r| (time(&r.outcome), r.outcome.algebraic_rel)).collect();
            marks(&answers, SAME_ALGEBRAIC)
        };
        let (warm, cold) = (of(|o| o.warm.median, &same), of(|o| o.cold.median, &same));
        for ((row, warm), cold) in same.iter_mut().zip(warm).zip(cold) {
            (row.best.warm_algebraic, row.best.cold_algebraic) = (warm, cold);
        }
    }
    let of = |time: fn(&Outcome) -> f64| -> Vec<bool> {
        let answers: Vec<_> =
            rows.iter().map(|r| (time(&r.outcome), r.outcome.total_rel)).collect();
        marks(&answers, SAME_TOTAL)
    };
    let (warm, cold) = (of(|o| o.warm.median), of(|o| o.cold.median));
    for ((row, warm), cold) in rows.iter_mut().zip(warm).zip(cold) {
        (row.best.warm_total, row.best.cold_total) = (warm, cold);
    }
}

/// Table of all rows.
pub(super) fn table(rows: &[Row]) -> Table {
    let title = "Time of a warm frame and of a cold start against error";
    let mut table = Table::new("frontier", title, &COLUMNS);
    for row in rows {
        let Outcome { way, cold, warm, residual_rel, algebraic_rel, total_rel } = &row.outcome;
        let best = |warm: bool, cold: bool| match (warm, cold) {
            (true, true) => "warm, cold",
            (true, false) => "warm",
            (false, true) => "cold",
            (false, false) => "",
        };
        let cells: [Cell; 17] = [
            row.object.as_str().into(),
            row.discretisation.name().into(),
            row.system_nodes.into(),
            row.unknown_dofs.into(),
            way.name().into(),
            way.precision().into(),
            way.tolerance().into(),
            warm.median.into(),
            warm.min.into(),
            warm.max.into(),
            cold.median.into(),
            cold.min.into(),
            (*residual_rel).into(),
            (*algebraic_rel).into(),
            (*total_rel).into(),
            best(row.best.warm_algebraic, row.best.cold_algebraic).into(),
            best(row.best.warm_total, row.best.cold_total).into(),
        ];
        table.push(cells);
    }
    table
}

const COLUMNS: [&str; 17] = [
    "object",
    "element",
    "system_nodes",
    "unknown_dofs",
    "method",
    "precision",
    "tolerance",
    "warm_ms",
    "warm_min_ms",
    "warm_max_ms",
    "cold_ms",
    "cold_min_ms",
    "residual_rel",
    "algebraic_error_rel",
    "total_error_rel",
    "best_by_algebraic_error",
    "best_by_total_error",
];
