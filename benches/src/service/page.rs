//! The report: its bars, and the sections that measure them.

use super::{beside, receiving};
use crate::programs::Programs;
use crate::report::{Options, Report, ReportError};
use crate::table::{Cell, Table};
use crate::threads::processors;

/// The table of bars, and where a broken one is told.
pub(super) struct Bars<'a> {
    table: Table,
    report: &'a mut Report,
    is_quick: bool,
}

impl Bars<'_> {
    /// A row; a bar that is not kept is a fault, but not in the quick form, whose figures mean little.
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

    /// The report, for tables of its own.
    pub fn report(&mut self) -> &mut Report {
        self.report
    }
}

/// Measures the report.
///
/// # Errors
/// [`ReportError`].
pub fn measure(options: &Options) -> Result<Report, ReportError> {
    let title = "What one client's long work costs the others";
    let mut report = Report::begin("service", title, &processors().to_string(), options);
    let programs = Programs::find()?;
    let columns = ["what", "measured", "bar", "unit", "kept"];
    let table = Table::new("service-bars", "Bars", &columns);
    let mut bars = Bars { table, report: &mut report, is_quick: options.is_quick };
    beside::measure(&programs, &mut bars)?;
    receiving::measure(&programs, &mut bars)?;
    let table = bars.table;
    report.table(table);
    Ok(report)
}

impl Bars<'_> {
    /// Whether small sizes and few rounds are asked for.
    pub fn is_quick(&self) -> bool {
        self.is_quick
    }
}
