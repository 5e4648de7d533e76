//! One row of the report: a number of clients, and what they saw.

use crate::table::Cell;
use crate::tail::Tail;

/// One number of clients, measured.
pub(super) struct Row {
    pub what: String,
    pub clients: usize,
    pub answers: usize,
    pub tail: Tail,
    /// Processors that the server kept busy.
    pub server_busy: Option<f64>,
    /// Processors that the clients kept busy.
    pub clients_busy: Option<f64>,
}

impl Row {
    /// What the tables show.
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
