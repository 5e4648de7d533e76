//! Report `trust`: a server under malformed frames, hostile connections, long work of others, restarts
//! and a long run.

mod hostile;
mod long_run;
mod malformed;
mod restarts;

use crate::programs::{Programs, Server};
use crate::report::{Options, Report, ReportError};
use crate::table::{Cell, Table};
use crate::threads::processors;

/// How much of everything.
#[derive(Clone, Copy, Debug)]
struct Amounts {
    connections: usize,
    frames: usize,
    restarts: usize,
    beats_s: f64,
    rounds: usize,
}

/// Measures the report.
///
/// # Errors
/// [`ReportError`].
pub fn measure(options: &Options) -> Result<Report, ReportError> {
    let threads = processors().to_string();
    let mut report = Report::begin("trust", "A server one can trust", &threads, options);
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
    let mut bars = Table::new("trust", "Bars", &["what", "measured", "bar", "unit", "kept"]);
    malformed::measure(&programs, amounts, &mut bars, &mut report)?;
    hostile::measure(&programs, amounts, options.is_quick, &mut bars, &mut report)?;
    restarts::measure(&programs, amounts, &mut bars, &mut report)?;
    long_run::measure(&programs, amounts, &mut bars, &mut report)?;
    report.table(bars);
    report.text(include_str!("beside.md"));
    Ok(report)
}

/// A row of the table of bars; not kept is a fault, but not in the quick form, whose figures mean little.
fn bar(
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

fn server(programs: &Programs, address: &str) -> Result<Server, ReportError> {
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
