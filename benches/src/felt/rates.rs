//! Whether forces keep their millisecond: runs of the client with a server over TCP, five fingers in them.

use std::ffi::OsStr;

use serde_json::Value;

use crate::programs::Programs;
use crate::report::{ReportError, progress};
use crate::table::{Cell, Table};
use crate::threads::processors;

/// Adds a row for a run on an object of so many nodes.
fn row(programs: &Programs, nodes: usize, ticks: usize) -> Result<Vec<Cell>, ReportError> {
    progress("felt", &format!("a run with forces, {nodes} nodes"));
    let server = programs.serve(processors())?;
    let folder = tempfile::tempdir().map_err(|source| ReportError::Process {
        what: "a folder for the run".to_owned(),
        source,
    })?;
    let (report, record) = (folder.path().join("run.json"), folder.path().join("force.csv"));
    let record = format!("record:{}", record.display());
    let (nodes_text, ticks_text) = (nodes.to_string(), ticks.to_string());
    let arguments = [
        "run",
        "--headless",
        "--grasp",
        "contact",
        "--object",
        "sphere",
        "--hand",
        "scripted:lift",
        "--rate",
        "60",
        "--nodes",
        &nodes_text,
        "--ticks",
        &ticks_text,
        "--server",
        &server.address,
        "--force",
        &record,
        "--report",
    ];
    let mut all: Vec<&OsStr> = arguments.iter().map(OsStr::new).collect();
    all.push(report.as_os_str());
    programs.ask(&all, folder.path(), "felt")?.succeed()?;
    let text = std::fs::read_to_string(&report)
        .map_err(|source| ReportError::Process { what: report.display().to_string(), source })?;
    let told: Value = serde_json::from_str(&text).unwrap_or_default();
    let force = &told["force"];
    let number = |name: &str| force[name].as_f64();
    let worst = &told["summary"]["contact"]["residual_rel_max"];
    Ok(vec![
        nodes.into(),
        Cell::Count(force["ticks"].as_u64().unwrap_or_default()),
        if force["is_urgent"] == true { "yes" } else { "no" }.into(),
        number("late_share").map(|share| 100.0 * share).into(),
        number("late_worst_ms").into(),
        number("computed_worst_ms").into(),
        number("answer_age_worst_ms").into(),
        number("force_max_n").into(),
        number("energy_created_j").map(|energy| 1e3 * energy).into(),
        worst.as_f64().into(),
    ])
}

/// Measures the table of rates.
///
/// # Errors
/// [`ReportError`], also for a run that fails.
pub(super) fn table(is_quick: bool) -> Result<Table, ReportError> {
    let (sizes, ticks): (&[usize], usize) =
        if is_quick { (&[300], 120) } else { (&[1000, 10_648, 21_952], 1200) };
    let programs = Programs::find()?;
    let mut table = Table::new("felt-rates", "Forces at 1 kHz beside a run over TCP", &COLUMNS);
    for &nodes in sizes {
        table.push(row(&programs, nodes, ticks)?);
    }
    Ok(table)
}

const COLUMNS: [&str; 10] = [
    "nodes",
    "ticks",
    "real_time",
    "late_percent",
    "late_worst_ms",
    "computed_worst_ms",
    "answer_age_worst_ms",
    "force_max_N",
    "created_mJ",
    "contact_residual_rel_max",
];
