//! Writes the page: late ticks with and without a server, with and without real-time scheduling.

use softgrasp_core::mesh::BuiltIn;

use super::holder::{Holder, right};
use super::kept::{Kept, Tick};
use super::turns::{Pair, is_granted, take_turns};
use crate::plot::{Mark, Plot, Scale, Series};
use crate::report::{Options, Report, ReportError, progress};
use crate::sample::Spread;
use crate::scene::Pressed;
use crate::table::{Cell, Table, three_digits};
use crate::tail::{Tail, longer_than};
use crate::threads::processors;

/// Largest share of late answers, per cent.
const LATE_BAR_PERCENT: f64 = 0.1;
/// Object that the limit is for, and its approximate number of nodes.
const NODES: usize = 10_648;
/// Number of turns, and of ticks in each.
const TURNS: (usize, usize) = (60, 1000);

/// Asks a frame question every millisecond, in turn with loops that ask nothing.
///
/// # Errors
/// [`ReportError`], also for an answer that differs from the direct solve.
pub fn measure(options: &Options, report: &mut Report) -> Result<(), ReportError> {
    let (nodes, (turns, ticks)) = if options.is_quick { (125, (2, 250)) } else { (NODES, TURNS) };
    let threads = processors();
    let scene = Pressed::try_new(BuiltIn::Cube, nodes)?;
    let right = right(&scene)?;
    let is_granted = is_granted();
    let rights: &[bool] = if is_granted { &[true, false] } else { &[false] };
    let mut holders = Vec::new();
    for &real_time in rights {
        progress("hold", "waiting for the proof of the error bound");
        holders.push((real_time, Holder::try_new(&scene, &right, threads, real_time)?));
    }
    progress(
        "hold",
        &format!("{turns} turns of {ticks} ticks of 1 ms, {} loops", 2 * rights.len()),
    );
    let pairs = take_turns(holders, turns, ticks)?;
    report.text(INTRODUCTION);
    report.text(urgency(is_granted));
    report.text(pairs.iter().map(|pair| verdict(pair, &scene)).collect::<String>());
    report.table(times(&pairs, &scene));
    report.figure("latency-hold", FIGURE, curve(&pairs)?);
    report.table(stages(&pairs));
    Ok(())
}

fn yes(is_so: bool) -> &'static str {
    if is_so { "yes" } else { "no" }
}

fn with_rights(real_time: bool) -> &'static str {
    if real_time { "with real-time rights" } else { "without real-time rights" }
}

fn verdict(pair: &Pair, scene: &Pressed) -> String {
    let (late, of_control) = (pair.asking.late_percent(), pair.control.late_percent());
    let word = match (scene.mesh.node_count() == NODES, late < LATE_BAR_PERCENT) {
        (false, _) => "",
        (true, true) => ": reached",
        (true, false) => ": **not reached**",
    };
    format!(
        "- {}: {} of {} ticks are late ({} %), {} of them not asked for any more; of the loop that \
         asks nobody {} of {} ({} %). Bar: below {LATE_BAR_PERCENT} % for a minute{word}.\n",
        with_rights(pair.real_time),
        pair.asking.late(),
        pair.asking.count(),
        three_digits(late),
        pair.asking.missed,
        pair.control.late(),
        pair.control.count(),
        three_digits(of_control),
    )
}

fn urgency(is_granted: bool) -> String {
    let (word, then) = match is_granted {
        true => ("grants", "each loop is kept with it and without it"),
        false => ("does not grant", "so each loop is kept without it only"),
    };
    format!(
        "The thread that keeps the ticks, and the server's that reads, solves and answers, can ask \
         for real-time scheduling; this system {word} it: {then}."
    )
}

fn times(pairs: &[Pair], scene: &Pressed) -> Table {
    let title = "Ticks of 1 ms: over loopback, condensed, five contacts; and nobody asked";
    let mut table = Table::new("latency-hold", title, &COLUMNS);
    for pair in pairs {
        table.push(row(pair, false, scene));
        table.push(row(pair, true, scene));
    }
    table
}

/// Row of the table; a loop without a server has no answers.
fn row(pair: &Pair, is_control: bool, scene: &Pressed) -> [Cell; 22] {
    let kept = if is_control { &pair.control } else { &pair.asking };
    let (from_tick, work) = (Tail::of(kept.of(|t| t.from_tick)), Tail::of(kept.of(|t| t.work)));
    let sending_late = Tail::of(kept.of(|t| t.from_tick - t.work));
    let bounds: Vec<f64> = kept.ticks.iter().filter_map(|t| t.solved.error_bound_rel).collect();
    let with_bound = 100.0 * bounds.len() as f64 / kept.ticks.len().max(1) as f64;
    let worst = |of: fn(&Tick) -> f64| Spread::of(kept.of(of)).max;
    let of_answers = |value: f64| (!is_control).then_some(value);
    [
        if is_control { "nobody" } else { "the server" }.into(),
        yes(pair.real_time).into(),
        scene.mesh.node_count().into(),
        scene.surface.nodes.len().into(),
        kept.lasted.as_secs_f64().into(),
        kept.count().into(),
        kept.missed.into(),
        kept.late().into(),
        kept.late_percent().into(),
        of_answers(pair.asking.late_percent() - pair.control.late_percent()).into(),
        from_tick.p50.into(),
        from_tick.p99.into(),
        from_tick.p999.into(),
        from_tick.p9999.into(),
        from_tick.max.into(),
        work.p50.into(),
        sending_late.p50.into(),
        sending_late.p999.into(),
        of_answers(with_bound).into(),
        of_answers(Spread::of(bounds).max).into(),
        of_answers(worst(|t| t.solved.residual_rel)).into(),
        of_answers(worst(|t| t.solved.error_rel)).into(),
    ]
}

/// Name of a share of a tick's time, and the share, ms.
type Part = (&'static str, fn(&Tick) -> f64);

fn stages(pairs: &[Pair]) -> Table {
    let title = "Where the time of a tick goes";
    let mut table = Table::new("latency-hold-stages", title, &STAGE_COLUMNS);
    let parts: [Part; 7] = [
        ("late in sending", |t| t.from_tick - t.work),
        ("decode", |t| t.solved.stages.decode),
        ("queue", |t| t.solved.stages.queue),
        ("factor", |t| t.solved.stages.order + t.solved.stages.factor),
        ("solve", |t| t.solved.stages.solve),
        ("gather", |t| t.solved.stages.encode),
        ("codecs, threads, way", |t| {
            let s = &t.solved.stages;
            t.work - s.decode - s.queue - s.order - s.factor - s.solve - s.encode
        }),
    ];
    for pair in pairs {
        let worst = Spread::of(pair.asking.of(|t| t.solved.error_rel)).max;
        for (name, part) in parts {
            let tail = Tail::of(pair.asking.of(part));
            let row: [Cell; 7] = [
                name.into(),
                yes(pair.real_time).into(),
                tail.p50.into(),
                tail.p99.into(),
                tail.p999.into(),
                tail.max.into(),
                worst.into(),
            ];
            table.push(row);
        }
    }
    table
}

fn curve(pairs: &[Pair]) -> Result<String, ReportError> {
    let series = |what: &str, pair: &Pair, kept: &Kept| Series {
        label: format!("{what}, {}", with_rights(pair.real_time)),
        mark: Mark::Line,
        points: longer_than(kept.of(|t| t.from_tick)),
    };
    let both = |pair: &Pair| {
        [
            series("the server asked", pair, &pair.asking),
            series("nobody asked", pair, &pair.control),
        ]
    };
    let plot = Plot {
        title: "A request every millisecond".to_owned(),
        x_label: "ms from the tick".to_owned(),
        y_label: "share of ticks that take longer".to_owned(),
        x_scale: Scale::Log,
        y_scale: Scale::Log,
        series: pairs.iter().flat_map(both).collect(),
    };
    Ok(plot.svg()?)
}

const COLUMNS: [&str; 22] = [
    "asked",
    "real_time",
    "nodes",
    "surface_nodes",
    "lasted_s",
    "ticks",
    "missed",
    "late",
    "late_percent",
    "late_above_control_percent",
    "p50_ms",
    "p99_ms",
    "p99.9_ms",
    "p99.99_ms",
    "max_ms",
    "work_p50_ms",
    "sending_late_p50_ms",
    "sending_late_p99.9_ms",
    "with_bound_percent",
    "error_bound_rel",
    "residual_rel",
    "error_rel",
];

const STAGE_COLUMNS: [&str; 7] =
    ["part", "real_time", "p50_ms", "p99_ms", "p99.9_ms", "max_ms", "error_rel"];

const FIGURE: &str = "Share of ticks that take longer, from the tick.";

const INTRODUCTION: &str = "\
A server in this process, over a loopback socket with TCP_NODELAY, keeps the cube. The client sends a \
request at each tick of an absolute schedule, one a millisecond: fifteen known degrees of freedom, \
another load each time, displacements of all surface nodes in double precision. As `run` does, it \
sleeps until shortly before the tick, stays awake for the rest, and stays awake for the answer for as \
long as an answer usually takes. A tick is late if its answer is not there before the next tick; \
a tick that passes while an earlier answer is awaited is late too and is not asked for any more, as \
the newest request wins in the client. Times are counted from the tick, not from sending, so waiting \
behind a slow answer counts.

The control asks nobody. It sleeps and wakes by the same schedule, prepares the same request, stays \
awake for as long as the median answer of the newest turn took, and compares an answer that it kept. \
What is late there is late because of the machine, not of the server. The loops take turns of a \
second, and each turn another one begins, so all of them see the same minutes. \
`late_above_control_percent` is the difference.

Every answer carries its residual and, once the proof is made (it is waited for), its proven error \
bound; rotation and strain are worked out beside the frames, on the same threads. Every answer is \
compared with a direct solve refined in twice the working precision, between the answer and the next \
tick; above 1e-9 the report ends.";
