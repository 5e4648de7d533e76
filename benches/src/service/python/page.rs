//! Page of the report: both clients in turns, their frame rates and the ratio.

use std::time::Duration;

use super::asked::{Asked, Rust, Trip};
use super::peer::{Interpreter, Python};
use crate::programs::Programs;
use crate::report::{Options, Report, ReportError, check, progress};
use crate::sample::{Competitor, Effort, Spread, take_turns};
use crate::table::{Cell, Table, three_digits};
use crate::threads::processors;

/// Least share of the Rust client's frame rate.
const RATE_BAR: f64 = 0.6;
/// Largest error, relative to a direct solve, with which a time is reported.
const ERROR_ALLOWED: f64 = 1e-9;

/// Measures the report.
///
/// # Errors
/// [`ReportError`], also for a wrong answer to either client.
pub fn measure(options: &Options, report: &mut Report) -> Result<(), ReportError> {
    let interpreter = match Interpreter::find() {
        Ok(interpreter) => interpreter,
        Err(why) => {
            progress("python", &format!("skipped: {why}"));
            report.text(format!("Not measured here: {why}."));
            return Ok(());
        }
    };
    let (nodes, block) = if options.is_quick { (216, 5) } else { (10_648, 200) };
    progress("python", &format!("{nodes} nodes, {}", interpreter.version));
    let asked = Asked::new(nodes)?;
    let folder = tempfile::tempdir()
        .map_err(|source| ReportError::Process { what: "a folder".to_owned(), source })?;
    asked.write(folder.path())?;
    let server = Programs::find()?.serve(processors())?;
    let mut rust = Rust::connect(&server.address, &asked)?;
    let mut python = Python::start(&interpreter, &server.address, folder.path())?;
    let blocks = in_turns(options.is_quick, block, &mut rust, &mut python)?;
    write(report, &interpreter.version, &asked, &blocks)?;
    Ok(())
}

/// Blocks of frames of both clients, in turns.
fn in_turns(
    is_quick: bool,
    block: usize,
    rust: &mut Rust<'_>,
    python: &mut Python,
) -> Result<[Vec<Vec<Trip>>; 2], ReportError> {
    let (rounds_min, rounds_max, seconds) = if is_quick { (5, 10, 1) } else { (100, 400, 15) };
    let budget = Duration::from_secs(seconds);
    let effort = Effort { warm_up_rounds: 3, rounds_min, rounds_max, budget };
    // Both ask the same loads.
    let (mut by_rust, mut by_python) = (0, 0);
    let mut competitors: [Competitor<'_, Vec<Trip>, ReportError>; 2] = [
        Box::new(|| {
            by_rust += block;
            rust.block(by_rust, block)
        }),
        Box::new(|| {
            by_python += block;
            python.block(by_python, block)
        }),
    ];
    let mut results = take_turns(&effort, &mut competitors)?.into_iter();
    Ok([results.next().unwrap_or_default(), results.next().unwrap_or_default()])
}

fn write(
    report: &mut Report,
    version: &str,
    asked: &Asked,
    blocks: &[Vec<Vec<Trip>>; 2],
) -> Result<(), ReportError> {
    let [rust, python] = blocks;
    let share = Spread::of_ratio(&rates(python), &rates(rust));
    report.text(format!(
        "Both clients ask one `fea-server` of this machine for frames of a cube that is held at five nodes, in \
         turns of blocks of 200 frames: displacements of all surface nodes come back in double precision, by \
         `condensed`. A frame's time runs from the numbers of its prescribed displacements to those of the \
         answer, in {version} as in Rust, with a client that sleeps while it waits. `rate rel` is the \
         frame rate of a block over that of the Rust client's block beside it: the median, and what a tenth of \
         the blocks is below and above. Every answer is compared with a direct solve. The frame rate of the \
         Python client is {} of the Rust client's; asked for is {RATE_BAR}. In blocks of 20 frames, 4 ms, in \
         which each program begins where it has just rested, it was 0.56 and 0.58 of it (2026-11-27, two runs \
         on the machine of this report).",
        three_digits(share.median)
    ));
    // Times of so small a cube as that of the small form mean little.
    if asked.scene.mesh.node_count() > 10_000 && share.median < RATE_BAR {
        report.fault(format!(
            "frame rate of the Python client over the Rust client's: {:.3}, the bar is {RATE_BAR}",
            share.median
        ));
    }
    let mut table = Table::new("service-python", "Warm frames of both clients, in turns", &COLUMNS);
    let ones = Spread { median: 1.0, p10: 1.0, p90: 1.0, ..Spread::default() };
    table.push(row("Rust", asked, rust, ones)?);
    table.push(row("Python", asked, python, share)?);
    report.table(table);
    Ok(())
}

const COLUMNS: [&str; 12] = [
    "client",
    "nodes",
    "surface_nodes",
    "frames",
    "p10_ms",
    "median_ms",
    "p90_ms",
    "rate_hz",
    "rate_rel_p10",
    "rate_rel",
    "rate_rel_p90",
    "error_rel",
];

/// Row of one client; a wrong answer is an error.
fn row(
    client: &str,
    asked: &Asked,
    blocks: &[Vec<Trip>],
    share: Spread,
) -> Result<[Cell; 12], ReportError> {
    let ms = Spread::of(blocks.iter().flatten().map(|trip| trip.ms));
    let error = blocks.iter().flatten().fold(0.0, |most: f64, trip| {
        if trip.error_rel.is_nan() { f64::INFINITY } else { most.max(trip.error_rel) }
    });
    check(|| format!("frames of the client in {client}"), error, ERROR_ALLOWED)?;
    Ok([
        Cell::Text(client.to_owned()),
        Cell::Count(asked.scene.mesh.node_count() as u64),
        Cell::Count(asked.scene.surface.nodes.len() as u64),
        Cell::Count(ms.count as u64),
        Cell::Number(ms.p10),
        Cell::Number(ms.median),
        Cell::Number(ms.p90),
        Cell::Number(Spread::of(rates(blocks)).median),
        Cell::Number(share.p10),
        Cell::Number(share.median),
        Cell::Number(share.p90),
        Cell::Number(error),
    ])
}

/// Frames in each second, of every block.
fn rates(blocks: &[Vec<Trip>]) -> Vec<f64> {
    let rate = |trips: &Vec<Trip>| {
        1e3 * trips.len() as f64 / trips.iter().map(|trip| trip.ms).sum::<f64>()
    };
    blocks.iter().map(rate).collect()
}
