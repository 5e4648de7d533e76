//! Measures all parts, one after the other.

use super::bars::Amounts;
use super::{hostile, long_run, malformed, restarts};
use crate::programs::Programs;
use crate::report::{Options, Report, ReportError};
use crate::table::Table;

/// Measures the report.
///
/// # Errors
/// [`ReportError`].
pub fn measure(options: &Options, report: &mut Report) -> Result<(), ReportError> {
    let programs = Programs::find()?;
    let amounts = match options.is_quick {
        true => Amounts { connections: 400, frames: 2000, restarts: 2, beats_s: 1.0, rounds: 1 },
        false => {
            Amounts { connections: 100_000, frames: 900_000, restarts: 20, beats_s: 8.0, rounds: 3 }
        }
    };
    report.text(
        "Clients and server are processes of one machine and share its processors; hostile clients do \
         their own side of it at the lowest priority, for they would be other machines. A row that does not \
         keep its bar is a fault of this report. What is tested besides, with the commands, is below the \
         tables.",
    );
    let mut bars =
        Table::new("service-trust", "Bars", &["what", "measured", "bar", "unit", "kept"]);
    malformed::measure(&programs, amounts, &mut bars, report)?;
    hostile::measure(&programs, amounts, options.is_quick, &mut bars, report)?;
    restarts::measure(&programs, amounts, &mut bars, report)?;
    long_run::measure(&programs, amounts, &mut bars, report)?;
    report.table(bars);
    report.text(include_str!("beside.md"));
    Ok(())
}
