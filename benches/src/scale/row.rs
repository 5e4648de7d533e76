//! One row of the report: a way, a size, and what came of it.

use softgrasp_protocol::SolveReport;

use super::way::Way;
use crate::table::Cell;

/// What came of one question.
#[derive(Clone, Debug)]
pub(super) struct Row {
    pub nodes: usize,
    pub way: Way,
    pub outcome: Outcome,
}

/// An answer or a refusal.
#[derive(Clone, Debug)]
pub(super) enum Outcome {
    Answered(Box<Answered>),
    /// Refused before it was made, with the server's words.
    Refused {
        text: String,
    },
}

/// An answer that was found right.
#[derive(Clone, Debug)]
pub(super) struct Answered {
    /// Time from the first byte of the request to the last of the answer, s.
    pub wall_s: f64,
    /// Largest resident memory of all its processes, bytes.
    pub peak_bytes: f64,
    /// The server's own words.
    pub report: SolveReport,
    /// Largest force on a free node over the largest on a held one, by our own rows.
    pub imbalance: f64,
    /// Largest difference to the answer of `front`, over its largest displacement; `None` where `front`
    /// gave none.
    pub off_front: Option<f64>,
}

/// Columns of [`Row::cells`].
pub(super) const COLUMNS: [&str; 14] = [
    "nodes",
    "way",
    "outcome",
    "wall_s",
    "peak_memory_gib",
    "assemble_s",
    "order_s",
    "factor_or_set_up_s",
    "solve_s",
    "steps",
    "us_a_node",
    "error_estimate_rel",
    "off_front_rel",
    "residual_rel",
];
pub(super) const GIB: f64 = 1_073_741_824.0;

impl Row {
    /// The answer, if there was one.
    pub fn answered(&self) -> Option<&Answered> {
        match &self.outcome {
            Outcome::Answered(answered) => Some(answered),
            Outcome::Refused { .. } => None,
        }
    }

    /// Cells of the row.
    pub fn cells(&self) -> Vec<Cell> {
        let mut cells: Vec<Cell> = vec![self.nodes.into(), self.way.name().into()];
        let answered = match &self.outcome {
            Outcome::Answered(answered) => answered,
            Outcome::Refused { text } => {
                cells.push(format!("refused: {text}").into());
                return cells;
            }
        };
        let Answered { wall_s, peak_bytes, report, imbalance, off_front } = answered.as_ref();
        let stages = &report.stage_ms;
        cells.push("answered".into());
        cells.push((*wall_s).into());
        cells.push((peak_bytes / GIB).into());
        for ms in [stages.assemble, stages.order, stages.factor, stages.solve] {
            cells.push(Some(1e-3 * ms).filter(|s| *s > 0.0).into());
        }
        let steps = self.way.is_iterated().then_some(f64::from(report.refinement_steps));
        cells.push(steps.map_or(Cell::Blank, |steps| Cell::Count(steps as u64)));
        cells.push((1e6 * wall_s / self.nodes as f64).into());
        cells.push(report.error_estimate_rel.into());
        cells.push((*off_front).into());
        cells.push((*imbalance).into());
        cells
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use softgrasp_core::solve::Method;

    #[test]
    fn a_row_has_a_cell_for_every_column_and_a_refusal_its_reason() {
        let answered = Answered {
            wall_s: 2.0,
            peak_bytes: GIB,
            report: SolveReport { refinement_steps: 15, ..SolveReport::default() },
            imbalance: 1e-12,
            off_front: None,
        };
        let way = Way::One(Method::Multigrid);
        let outcome = Outcome::Answered(Box::new(answered));
        let cells = Row { nodes: 1000, way, outcome }.cells();
        assert_eq!(cells.len(), COLUMNS.len());
        let at = |name: &str| &cells[COLUMNS.iter().position(|c| *c == name).unwrap()];
        assert_eq!(at("steps"), &Cell::Count(15));
        assert_eq!(at("us_a_node"), &Cell::Number(2000.0));
        assert_eq!(at("order_s"), &Cell::Blank);
        let outcome = Outcome::Refused { text: "too much".to_owned() };
        let refused = Row { nodes: 1000, way, outcome };
        assert_eq!(refused.cells()[2], "refused: too much".into());
        assert!(refused.answered().is_none());
    }
}
