//! What all parts of the report share: how much of everything, rows of bars, a server.

use crate::programs::{Programs, Server};
use crate::report::{Report, ReportError};
use crate::table::{Cell, Table};
use crate::threads::processors;

/// How much of everything.
#[derive(Clone, Copy, Debug)]
pub(super) struct Amounts {
    pub connections: usize,
    pub frames: usize,
    pub restarts: usize,
    pub beats_s: f64,
    pub rounds: usize,
}

/// A row of the table of bars; not kept is a fault, but not in the quick form, whose figures mean little.
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

/// A server for many sessions, and as many requests as they like.
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
