//! Writes the page: the rows, what they say beside each other, laws, a model, and figures.

use softgrasp_core::solve::Method;

use super::case::{Means, rows};
use super::row::{Answered, COLUMNS, GIB, Row};
use super::way::{WAYS, Way, why_no_worker};
use super::{laws, machines};
use crate::axis::Scale;
use crate::plot::{Mark, Plot, PlotPoint, Series};
use crate::programs::Programs;
use crate::report::{Options, Report, ReportError};
use crate::table::{Table, three_digits};
use crate::threads::processors;

/// Numbers of nodes, all of them third powers: the cube is a plain lattice.
const NODES: [usize; 7] = [10_648, 21_952, 42_875, 97_336, 157_464, 343_000, 1_000_000];
/// How many of them the small form takes.
const QUICK: usize = 5;
/// Share of the memory that is free at the beginning which a way may take; the rest is this program's.
const MEMORY_SHARE: f64 = 0.8;
/// Bars at about 160 000 nodes: time and memory of `multigrid` over those of `front`.
const TIME_BAR: f64 = 0.4;
const MEMORY_BAR: f64 = 1.0 / 6.0;
/// Size from which on the bars hold, and the one whose memory has a bar of its own.
const LARGE: usize = 150_000;
const MILLION: usize = 1_000_000;
/// Bar of the memory of a million nodes, GiB.
const MILLION_BAR_GIB: f64 = 6.0;
/// Bar of the steps of `multigrid`.
const STEPS_BAR: u32 = 30;

/// Asks all ways about cubes of 10⁴ to 10⁶ nodes; in the small form up to 1.6·10⁵.
///
/// # Errors
/// [`ReportError`], also for a wrong answer.
pub fn measure(options: &Options) -> Result<Report, ReportError> {
    measure_sizes(options, if options.is_quick { &NODES[..QUICK] } else { &NODES })
}

/// Asks all ways about cubes of the given sizes.
///
/// # Errors
/// Those of [`measure`].
pub fn measure_sizes(options: &Options, sizes: &[usize]) -> Result<Report, ReportError> {
    let title = "Scale: nodes against time and memory, past the factor and past one process";
    let mut report = Report::begin("scale", title, &processors().to_string(), options);
    let programs = Programs::find()?;
    let free = fea_server::available_bytes().unwrap_or(8 << 30);
    let memory = (MEMORY_SHARE * free as f64) as u64;
    let no_worker = why_no_worker(&programs);
    let means = Means { programs: &programs, memory, has_worker: no_worker.is_none() };
    let mut all: Vec<Row> = Vec::new();
    for &nodes in sizes {
        all.extend(rows(&means, nodes)?);
    }
    report.text(introduction(memory));
    if let Some(why) = no_worker {
        report.text(format!("No worker was asked: {}.", why.trim_end_matches('.')));
    }
    report.text(beside_each_other(&all));
    let mut table = Table::new("scale", "Cubes by every way", &COLUMNS);
    all.iter().for_each(|row| table.push(row.cells()));
    report.table(table);
    figures(&mut report, &all)?;
    let laws = laws::laws(&all);
    if !laws.is_empty() {
        report.chapter("Laws of cost");
        report.text(laws::words(&laws, memory));
        report.table(laws::table(&laws, memory));
    }
    report.chapter("Several machines");
    match machines::model(&all) {
        Some((words, table)) => {
            report.text(words);
            report.table(table);
        }
        None => report.text("There is no model: it begins with a worker on several ranks."),
    }
    Ok(report)
}

fn figures(report: &mut Report, rows: &[Row]) -> Result<(), ReportError> {
    let figure = |title: &str, y_label: &str, value: fn(&Answered) -> f64| {
        let series = |way: Way| {
            let of_way = rows.iter().filter(|row| row.way == way);
            let points: Vec<PlotPoint> = of_way
                .filter_map(|row| {
                    let (x, y) = (row.nodes as f64, value(row.answered()?));
                    Some(PlotPoint { x, y, spread: None })
                })
                .collect();
            let label = way.name();
            (!points.is_empty()).then_some(Series { label, mark: Mark::Line, points })
        };
        Plot {
            title: title.to_owned(),
            x_label: "nodes".to_owned(),
            y_label: y_label.to_owned(),
            x_scale: Scale::Log,
            y_scale: Scale::Log,
            series: WAYS.into_iter().filter_map(series).collect(),
        }
        .svg()
    };
    let time = figure("Time of one answer", "wall, s", |answered| answered.wall_s)?;
    report.figure("scale-time", "From the request's first byte to the answer's last.", time);
    let memory = figure("Largest memory", "peak of all processes, GiB", |answered| {
        answered.peak_bytes / GIB
    })?;
    report.figure("scale-memory", "Largest resident memory, summed over the ranks.", memory);
    Ok(())
}

/// What the rows say beside each other, each bar with its figures.
fn beside_each_other(rows: &[Row]) -> String {
    let answered = |way: Way, nodes: usize| {
        rows.iter().find(|row| row.way == way && row.nodes == nodes)?.answered()
    };
    let (front, multigrid) = (Way::One(Method::Front), Way::One(Method::Multigrid));
    let of_multigrid = || {
        let of_way = rows.iter().filter(|row| row.way == multigrid);
        of_way.filter_map(|row| Some((row.nodes, row.answered()?)))
    };
    let mut lines = Vec::new();
    let both = of_multigrid().filter_map(|(nodes, m)| Some((nodes, m, answered(front, nodes)?)));
    if let Some((nodes, multigrid, front)) = both.max_by_key(|(nodes, ..)| *nodes) {
        let time = multigrid.wall_s / front.wall_s;
        let memory = multigrid.peak_bytes / front.peak_bytes;
        let bars = match nodes >= LARGE {
            true => format!(
                "; the bars are {TIME_BAR} ({}) and a sixth ({})",
                kept(time <= TIME_BAR),
                kept(memory <= MEMORY_BAR)
            ),
            false => String::new(),
        };
        lines.push(format!(
            "- {nodes} nodes, the largest size that `front` answered: `multigrid` takes {} of its time \
             and {} of its memory{bars}.",
            three_digits(time),
            three_digits(memory)
        ));
    }
    let largest = of_multigrid().max_by_key(|(nodes, _)| *nodes);
    if let Some((nodes, m)) = largest.filter(|(nodes, _)| *nodes >= MILLION) {
        let gib = m.peak_bytes / GIB;
        lines.push(format!(
            "- {nodes} nodes by `multigrid`: {} s and {} GiB; the bar is {MILLION_BAR_GIB} GiB ({}).",
            three_digits(m.wall_s),
            three_digits(gib),
            kept(gib < MILLION_BAR_GIB)
        ));
    }
    let steps: Vec<u32> = of_multigrid().map(|(_, m)| m.report.refinement_steps).collect();
    if let (Some(least), Some(most)) = (steps.iter().min(), steps.iter().max()) {
        lines.push(format!(
            "- `multigrid` takes {least} to {most} steps; the bar is {STEPS_BAR} ({}).",
            kept(*most <= STEPS_BAR)
        ));
    }
    let off = rows.iter().filter_map(|row| row.answered()?.off_front).fold(0.0, f64::max);
    let imbalances = rows.iter().filter_map(|row| Some(row.answered()?.imbalance));
    lines.push(format!(
        "- All answers differ from those of `front`, where it gave one, by {} of the largest displacement \
         at most, and leave {} of the largest holding force on a free node at most.",
        three_digits(off),
        three_digits(imbalances.fold(0.0, f64::max))
    ));
    lines.join("\n")
}

fn kept(is_kept: bool) -> &'static str {
    if is_kept { "kept" } else { "not kept" }
}

fn introduction(memory: u64) -> String {
    format!(
        "A cube of linear tetrahedra, six to a box, Poisson's ratio 0.3, stands on its lowest face; ten \
         nodes in the middle of the uppermost are pressed down and aside. It goes to a server as one \
         request with its mesh, which wants the displacements of all nodes and an estimate of their \
         error. `wall` is the time from the request's first byte to the answer's last, over a socket of \
         this machine; the stages are the server's own, and `solve` has the estimate in it. Every row is \
         a process of its own, or as many as there are ranks, started for this one question, alone on the \
         machine: `peak memory` is their largest resident memory (`VmHWM`), added up over ranks. Each way \
         may take {} GiB; what it predicts not to fit is refused before it is made, and its row says the \
         prediction. `worker` is `fea-worker` with `cluster-cg` on ranks of this machine, each computing \
         on one processor, {} of which are there.\n\n\
         `residual` is found here from the displacements, by rows of the stiffness that are assembled \
         here: the largest force on a free node over the largest on a held one. `off front` is the \
         largest difference to the answer of `front`, over its largest displacement. Above 1e-8 either \
         ends the report. `steps` are those of conjugate gradients.",
        three_digits(memory as f64 / GIB),
        processors()
    )
}
