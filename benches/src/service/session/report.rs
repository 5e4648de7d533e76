//! Writes the page: age of the shown answer, ticks without one with their reasons, and one large object.

use std::path::Path;

use super::{large, live};

use super::record::Record;
use super::way::{Arrangement, Object, RATE_HZ, play};
use crate::programs::Programs;
use crate::report::{Options, Report, ReportError, check, progress};
use crate::sample::Spread;
use crate::table::{Cell, Table};
use crate::tail::Tail;
use crate::threads::processors;

/// Files of other authors.
const FILES: [&str; 3] = ["banana.vtk", "liver.msh1.msh", "turtle.veg"];
/// Largest residual of an answer with which a time is reported.
const RESIDUAL_ALLOWED: f64 = 1e-9;
/// Number of nodes of the large sphere.
const LARGE: usize = 160_000;
/// Number of sessions at the same time.
const SESSIONS: usize = 8;
/// Number of runs of each arrangement with one client.
const RUNS: usize = 3;

/// Plays all objects in all arrangements.
///
/// # Errors
/// [`ReportError`], also for a run that hangs, and for an answer with a large residual.
pub fn measure(options: &Options, report: &mut Report) -> Result<(), ReportError> {
    let programs = Programs::find()?;
    let threads = processors();
    let (sessions, runs) = if options.is_quick { (2, 1) } else { (SESSIONS, RUNS) };
    let arrangements = [
        (Arrangement::Embedded, runs),
        (Arrangement::TwoProcesses, runs),
        (Arrangement::ManySessions(sessions), 1),
    ];
    let folder = tempfile::tempdir().map_err(|source| ReportError::Process {
        what: "a folder for the runs".to_owned(),
        source,
    })?;
    let (objects, left_out) = objects(options);
    let [mut ages, mut lifts] = [
        ("service-session", AGE_TITLE),
        ("service-session-picked-up", "An object that is picked up by friction"),
    ]
    .map(|(name, title)| Table::new(name, title, &COLUMNS));
    let mut kept = Table::new("service-session-keep", "Keeping a shape", &KEEP_COLUMNS);
    let mut why =
        Table::new("service-session-unanswered", "Deforming ticks without answer", &WHY_COLUMNS);
    for object in objects.iter().chain([&picked_up()]) {
        for (arrangement, times) in arrangements {
            progress("session", &format!("{}, {}", object.name, arrangement.name()));
            let record = play(&programs, object, arrangement, times, threads, folder.path())?;
            let what = format!("{} {}", object.name, arrangement.name());
            check(|| what.clone(), record.residual_rel, RESIDUAL_ALLOWED)?;
            if !record.adds_up() {
                report.fault(format!("{what}: a deforming tick has neither answer nor reason"));
            }
            let table = if object.arguments.is_empty() { &mut lifts } else { &mut ages };
            table.push(age_row(object, arrangement, &record));
            kept.push(keep_row(object, arrangement, &record));
            why_rows(&mut why, object, arrangement, &record);
        }
    }
    report.text(INTRODUCTION.replace("{rate}", &RATE_HZ.to_string()));
    left_out.into_iter().for_each(|line| report.text(line));
    report.table(ages);
    report.text(PICKED_UP);
    report.table(lifts);
    report.table(kept);
    report.table(why);
    let nodes = if options.is_quick { 1000 } else { LARGE };
    let large = large::measure(&programs, nodes, folder.path())?;
    let live = live::measure(&programs, (runs, threads), folder.path(), options)?;
    report.text(LIVE);
    report.table(live);
    report.text(LARGE_OBJECT);
    report.table(large);
    Ok(())
}

/// What is grasped by the thesis's rules: a built-in object, and files of other authors; a line for each file
/// that is missing.
fn objects(options: &Options) -> (Vec<Object>, Vec<String>) {
    let named = |name: &str, path: &Path| Object {
        name: name.to_owned(),
        arguments: vec!["--grasp".into(), "thesis".into(), "--object".into(), path.into()],
        deformation: "linear",
    };
    let mut objects = vec![named("strawberry", Path::new("strawberry"))];
    let mut left_out = Vec::new();
    let files = if options.is_quick { &FILES[..0] } else { &FILES[..] };
    for file in files {
        let path = options.meshes.join(file);
        match path.is_file() {
            true => objects.push(named(file.split('.').next().unwrap_or(file), &path)),
            false => left_out.push(format!(
                "{file} is left out: it is not in the folder of meshes; name another by --meshes."
            )),
        }
    }
    (objects, left_out)
}

/// Default of `run`: the strawberry is picked up from a table and put down again.
fn picked_up() -> Object {
    let name = "strawberry, picked up".to_owned();
    Object { name, arguments: Vec::new(), deformation: "linear" }
}

fn age_row(object: &Object, arrangement: Arrangement, record: &Record) -> [Cell; 21] {
    let tail = |times: &[f64]| Tail::of(times.iter().copied());
    let (ages, trips) = (tail(&record.ages), tail(&record.round_trips));
    [
        object.name.as_str().into(),
        record.nodes.into(),
        arrangement.name().into(),
        record.runs.into(),
        (record.ticks as usize).into(),
        (record.skipped as usize).into(),
        (record.long as usize).into(),
        (record.deforming as usize).into(),
        (record.answered as usize).into(),
        (100.0 * record.answered as f64 / record.deforming.max(1) as f64).into(),
        ages.p50.into(),
        ages.p99.into(),
        ages.max.into(),
        median(&record.first_answers).into(),
        tail(&record.first_answers).max.into(),
        record.unseen_grips.into(),
        trips.p50.into(),
        trips.p99.into(),
        trips.max.into(),
        record.residual_rel.into(),
        record.error_bound_rel.into(),
    ]
}

/// Median of a few times; `None` if there are none.
fn median(times: &[f64]) -> Option<f64> {
    let spread = Spread::of(times.iter().copied());
    (spread.count > 0).then_some(spread.median)
}

fn keep_row(object: &Object, arrangement: Arrangement, record: &Record) -> [Cell; 9] {
    let tail = |times: &[f64]| Tail::of(times.iter().copied());
    let (keeps, ready) = (tail(&record.keeps), tail(&record.ready));
    [
        object.name.as_str().into(),
        record.nodes.into(),
        arrangement.name().into(),
        record.keeps.len().into(),
        median(&record.keeps).into(),
        keeps.max.into(),
        median(&record.ready).into(),
        ready.max.into(),
        record.residual_rel.into(),
    ]
}

fn why_rows(table: &mut Table, object: &Object, arrangement: Arrangement, record: &Record) {
    for (reason, count) in &record.unanswered {
        let row: [Cell; 6] = [
            object.name.as_str().into(),
            arrangement.name().into(),
            reason.replace('_', " ").into(),
            (*count as usize).into(),
            (100.0 * *count as f64 / record.deforming.max(1) as f64).into(),
            record.residual_rel.into(),
        ];
        table.push(row);
    }
}

const COLUMNS: [&str; 21] = [
    "object",
    "nodes",
    "server",
    "runs",
    "ticks",
    "skipped",
    "long_ticks",
    "deforming",
    "answered",
    "answered_percent",
    "age_p50_ms",
    "age_p99_ms",
    "age_max_ms",
    "first_answer_p50_ms",
    "first_answer_max_ms",
    "unseen_grips",
    "round_trip_p50_ms",
    "round_trip_p99_ms",
    "round_trip_max_ms",
    "residual_rel",
    "error_bound_rel",
];

const KEEP_COLUMNS: [&str; 9] = [
    "object",
    "nodes",
    "server",
    "shapes_kept",
    "keep_p50_ms",
    "keep_max_ms",
    "server_ready_p50_ms",
    "server_ready_max_ms",
    "residual_rel",
];

const WHY_COLUMNS: [&str; 6] =
    ["object", "server", "reason", "ticks", "share_of_deforming_percent", "residual_rel"];

const INTRODUCTION: &str = "\
`glove-client run --headless --rate {rate}` plays its scripted hand in real time: it grasps the \
object, squeezes it, keeps the shape, and grasps it again from another side. Each run is a process; \
`embedded` has the server in it, `two processes` asks a `fea-server --real-time` of its own, and in \
the last arrangement all clients are started at once and ask the same one. A server knows nothing \
when its runs begin. Everything below is from the JSON reports that the runs wrote.

`age`: at the end of each tick in which the fingers deform the object, the time since the beginning \
of the tick whose answer the object shows. A tick asks at its end and looks for answers at its \
beginning, so an answer is at least one tick old. `first answer`: from the beginning of the first \
deforming tick of a grip to the end of the one that shows the first answer of it; `unseen grips` are \
those of which nothing was ever shown. `skipped` ticks were too late to be played; `long ticks` \
computed for more than 1 ms. Every deforming tick without an answer has a reason, and the counts add \
up, or the report fails.

`keep` is the time for which the object stands still because its shape is being kept; `server ready` \
the time from then until a tick hears that the server has prepared the new shape (blank where another \
session had brought it). Both are seen by ticks, so they come in steps of one.

Every answer carries its residual, and a proven bound of its error where it has one; the largest of \
all are in the tables, and a residual above 1e-9 ends the report. The displacements of the same \
server are compared with direct solves in the reports `latency` and `contact`.";

const AGE_TITLE: &str = "Age of the shown answer, and first answers";

const PICKED_UP: &str = "\
The same of `run` without an object, which picks the strawberry up from a table by contact with \
friction: every tick is a step of the object's motion.";

const LIVE: &str = "\
The same runs with the equations that `run` takes by itself (`--deformation auto`): a live frame asks \
for its answer within the time of a tick, and a jump of the hand is followed over several frames. \
Ages are in ticks.";

const LARGE_OBJECT: &str = "\
A sphere made by `glove-client mesh`, five of its surface nodes known, is solved by one process \
(`glove-client solve`, server embedded, method chosen by it). `wall` is the life of the process, with \
reading and writing; `peak memory` is its largest resident memory. `residual` is computed here from \
the displacements it wrote: the largest force on a free node over the largest on a held one.";
