//! Shared by all parts of the report: sizes and numbers, rows of limits, a server.

use crate::programs::{Programs, Server};
use crate::report::{Report, ReportError};
use crate::table::{Cell, Table};
use crate::threads::processors;

/// Sizes and numbers of all parts.
#[derive(Clone, Copy, Debug)]
pub(super) struct Amounts {
    pub connections: usize,
    pub frames: usize,
    pub restarts: usize,
    pub beats_s: f64,
    pub rounds: usize,
}

/// Adds a row with a limit. One that is not kept is a fault, except in the small form, whose figures mean
/// little.
pub(super) fn bar(
    bars: &mut Table,
    report: &mut Report,
    is_quick: bool,
    (what, measured, bar, unit): (&str, f64, f64, &str),
) {
    let kept = measured <= bar;
    if !kept && !is_quick {
        report.fault(format!("{what}: {measured} {unit}, the bar is {bar}"));
    }
    let text = |text: &str| Cell::Text(text.to_owned());
    let kept = text(if kept { "yes" } else { "no" });
    bars.push([text(what), Cell::Number(measured), Cell::Number(bar), text(unit), kept]);
}

/// Server for many sessions with any number of requests.
pub(super) fn server(programs: &Programs, address: &str) -> Result<Server, ReportError> {
    let threads = processors().to_string();
    programs.serve_as(&[
        "--listen",
        address,
        "--threads",
        &threads,
        "--max-sessions",
        "1024",
        "--max-queue",
        "256",
    ])
}
