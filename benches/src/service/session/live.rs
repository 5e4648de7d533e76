//! Live frames at large deformation: share of answered ticks, and age of the shown shape.

use std::path::Path;

use super::way::{Arrangement, Object, RATE_HZ, play};
use crate::programs::Programs;
use crate::report::{Options, ReportError, progress};
use crate::table::Table;
use crate::tail::Tail;

/// Names of built-in objects.
const BUILT_IN: [&str; 2] = ["strawberry", "toothpaste"];
/// Files of other authors.
const FILES: [&str; 3] = ["banana.vtk", "liver.msh1.msh", "bunny.wrong-extension.vtk"];
/// Least share of answered deforming ticks, per cent, and largest age of a shown shape, in ticks.
const ANSWERED_PERCENT: f64 = 95.0;
const AGE_TICKS: f64 = 3.0;

const COLUMNS: [&str; 10] = [
    "object",
    "nodes",
    "runs",
    "deforming",
    "answered",
    "answered_percent",
    "age_p50_ticks",
    "age_max_ticks",
    "round_trip_max_ms",
    "bar",
];

/// Plays every object with the equations that `run` takes by default.
///
/// # Errors
/// [`ReportError`], also for a run that hangs.
pub(super) fn measure(
    programs: &Programs,
    (runs, threads): (usize, usize),
    folder: &Path,
    options: &Options,
) -> Result<Table, ReportError> {
    let title = "Live frames at large deformation";
    let mut table = Table::new("service-session-live", title, &COLUMNS);
    let paths = FILES.map(|file| options.meshes.join(file));
    let files = paths.iter().filter(|path| path.is_file() && !options.is_quick);
    let built_in = if options.is_quick { &BUILT_IN[..1] } else { &BUILT_IN[..] };
    let named = built_in.iter().map(Path::new).chain(files.map(|path| path.as_path()));
    for path in named {
        let name = path.file_name().map_or_else(String::new, |name| name.to_string_lossy().into());
        progress("session", &format!("live frames of {name}"));
        let arguments = vec!["--object".into(), path.as_os_str().to_owned()];
        let object = Object { name, arguments, deformation: "auto" };
        let record = play(programs, &object, Arrangement::Embedded, runs, threads, folder)?;
        let tick_ms = 1e3 / f64::from(RATE_HZ);
        let ages = Tail::of(record.ages.iter().map(|age| age / tick_ms));
        let trips = Tail::of(record.round_trips.iter().copied());
        let answered = 100.0 * record.answered as f64 / record.deforming.max(1) as f64;
        // An age is told at the end of a tick, so it is above whole ticks by what the tick computes.
        let is_young = ages.max.is_some_and(|age| age < AGE_TICKS + 1.0);
        let is_met = answered >= ANSWERED_PERCENT && is_young;
        table.push([
            object.name.as_str().into(),
            record.nodes.into(),
            record.runs.into(),
            (record.deforming as usize).into(),
            (record.answered as usize).into(),
            answered.into(),
            ages.p50.into(),
            ages.max.into(),
            trips.max.into(),
            if is_met { "met" } else { "not met" }.into(),
        ]);
    }
    Ok(table)
}
