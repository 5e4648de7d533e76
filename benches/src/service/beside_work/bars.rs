//! Limits that the service must keep, beside the measured values.

use crate::report::Report;
use crate::table::{Cell, Table};

/// Table of limits, and the report that is told of a broken one.
pub(super) struct Bars<'a> {
    table: Table,
    report: &'a mut Report,
    is_quick: bool,
}

impl<'a> Bars<'a> {
    /// Table without rows.
    pub fn new(report: &'a mut Report, is_quick: bool) -> Self {
        let columns = ["what", "measured", "bar", "unit", "kept"];
        let table = Table::new("service-bars", "Bars", &columns);
        Self { table, report, is_quick }
    }

    /// Adds the table to the report.
    pub fn write(self) {
        self.report.table(self.table);
    }

    /// Adds a row. A limit that is not kept is a fault, except in the small form, whose figures mean
    /// little.
    pub fn row(&mut self, what: &str, measured: f64, bar: f64, unit: &str) {
        // A figure that could not be had does not keep its bar.
        let is_kept = measured <= bar;
        if !is_kept && !self.is_quick {
            self.report.fault(format!("{what}: {measured:.3} {unit}, the bar is {bar}"));
        }
        let text = |text: &str| Cell::Text(text.to_owned());
        let kept = text(if is_kept { "yes" } else { "no" });
        let cells = [text(what), Cell::Number(measured), Cell::Number(bar), text(unit), kept];
        self.table.push(cells);
    }

    /// Report, for tables of its own.
    pub fn report(&mut self) -> &mut Report {
        self.report
    }

    /// Whether the small form is asked for.
    pub fn is_quick(&self) -> bool {
        self.is_quick
    }
}
