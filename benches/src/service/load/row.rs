//! Row of the report: a number of clients, and the times and errors of their answers.

use crate::table::Cell;
use crate::tail::Tail;

/// Measurement with one number of clients.
pub(super) struct Row {
    pub what: String,
    pub clients: usize,
    pub answers: usize,
    pub tail: Tail,
    /// Number of processors that the server kept busy.
    pub server_busy: Option<f64>,
    /// Number of processors that the clients kept busy.
    pub clients_busy: Option<f64>,
}

impl Row {
    /// Cells of the tables.
    pub fn cells(&self) -> Vec<Cell> {
        let number = |value: Option<f64>| value.map_or(Cell::Blank, Cell::Number);
        vec![
            Cell::Text(self.what.clone()),
            Cell::Count(self.clients as u64),
            Cell::Count(self.answers as u64),
            number(self.tail.p50),
            number(self.tail.p99),
            number(self.tail.max),
            number(self.server_busy),
            number(self.clients_busy),
        ]
    }
}
