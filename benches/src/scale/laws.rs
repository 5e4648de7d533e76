//! Laws of cost: how time and memory of each way grow with the nodes.

use super::row::{Answered, GIB, Row};
use super::way::{WAYS, Way};
use crate::fit::PowerLaw;
use crate::table::{Cell, Table, three_digits};

/// How time and memory of one way grow.
pub(super) struct Law {
    pub way: Way,
    /// Wall time, s.
    pub time: PowerLaw,
    /// Largest memory, bytes.
    pub memory: PowerLaw,
}

/// Laws of the ways that answered three sizes and more.
pub(super) fn laws(rows: &[Row]) -> Vec<Law> {
    let law = |way: Way| {
        let of_way = || rows.iter().filter(move |row| row.way == way);
        let fit = |value: fn(&Answered) -> f64| {
            let measured: Vec<(f64, f64)> = of_way()
                .filter_map(|row| Some((row.nodes as f64, value(row.answered()?))))
                .collect();
            PowerLaw::fit(&way.name(), &measured).ok()
        };
        Some(Law { way, time: fit(|a| a.wall_s)?, memory: fit(|a| a.peak_bytes)? })
    };
    WAYS.into_iter().filter_map(law).collect()
}

/// Table of the laws, and where each way's memory ends by its law.
///
/// Units: `memory` bytes.
pub(super) fn table(laws: &[Law], memory: u64) -> Table {
    let mut table = Table::new("scale-laws", "Laws of cost over the nodes V", &COLUMNS);
    for Law { way, time, memory: of_memory } in laws {
        let nodes_max = (memory as f64 / of_memory.k).powf(1.0 / of_memory.m);
        let row: [Cell; 9] = [
            way.name().into(),
            time.m.into(),
            time.m_error.into(),
            (100.0 * time.residual).into(),
            of_memory.m.into(),
            of_memory.m_error.into(),
            (100.0 * of_memory.residual).into(),
            time.count.into(),
            nodes_max.into(),
        ];
        table.push(row);
    }
    table
}

/// What the laws say, in words.
pub(super) fn words(laws: &[Law], memory: u64) -> String {
    let of = |Law { way, time, memory }: &Law| {
        format!(
            "- `{}`: time like V^({:.2} ± {:.2}), memory like V^({:.2} ± {:.2}).",
            way.name(),
            time.m,
            2.0 * time.m_error,
            memory.m,
            2.0 * memory.m_error
        )
    };
    let lines: Vec<String> = laws.iter().map(of).collect();
    format!(
        "{}\n\n`nodes_max` is where the law of its memory meets the {} GiB that a way may take here: an \
         extrapolation, which the refused rows of the first table bear out or not.",
        lines.join("\n"),
        three_digits(memory as f64 / GIB)
    )
}

const COLUMNS: [&str; 9] = [
    "way",
    "time_exponent",
    "time_std_error",
    "time_residual_percent",
    "memory_exponent",
    "memory_std_error",
    "memory_residual_percent",
    "sizes",
    "nodes_max",
];

#[cfg(test)]
mod tests {
    use softgrasp_core::solve::Method;
    use softgrasp_protocol::SolveReport;

    use super::*;
    use crate::scale::row::Outcome;

    pub(super) fn row(way: Way, nodes: usize, wall_s: f64, peak_bytes: f64) -> Row {
        let report = SolveReport::default();
        let answered = Answered { wall_s, peak_bytes, report, imbalance: 0.0, off_front: None };
        Row { nodes, way, outcome: Outcome::Answered(Box::new(answered)) }
    }

    #[test]
    fn exponents_are_those_of_the_rows_and_refused_rows_are_left_out() {
        let way = Way::One(Method::Front);
        let size = |nodes: usize| row(way, nodes, (nodes as f64).powi(2), 10.0 * nodes as f64);
        let mut rows: Vec<Row> = [1000, 2000, 4000].map(size).into();
        let text = "too large".to_owned();
        rows.push(Row { nodes: 8000, way, outcome: Outcome::Refused { text } });
        rows.push(row(Way::Ranks(1), 1000, 1.0, 1.0));
        let laws = laws(&rows);
        assert_eq!(laws.len(), 1, "one size makes no law");
        assert!((laws[0].time.m - 2.0).abs() < 1e-9 && (laws[0].memory.m - 1.0).abs() < 1e-9);
        let table = table(&laws, 80_000);
        let Cell::Number(nodes_max) = table.rows[0][8] else { panic!("no number") };
        assert!((nodes_max / 8000.0 - 1.0).abs() < 1e-9);
        assert!(words(&laws, 80_000).contains("`front`: time like V^(2.00 ± 0.00)"));
    }
}
