//! Writes the page: time of the first frame of a grip, beside that of one sparse solve.

use std::time::{Duration, Instant};

use glove_client::ask::connection::{Host, ServerChoice};
use softgrasp_core::mesh::BuiltIn;

use super::grips::{Grip, Grips, TOUCHED};
use super::trial::{SparseSolve, Toucher, Trial, error_of};
use crate::plot::{Mark, Plot, Scale, Series};
use crate::report::{Options, Report, ReportError, progress};
use crate::sample::Spread;
use crate::scene::Pressed;
use crate::table::{Cell, Table, three_digits};
use crate::tail::{Tail, longer_than};
use crate::threads::{pool, processors};

/// Kind of touch: number of nodes new to the server, and whether they were prefetched.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Kind {
    fresh: usize,
    is_prefetched: bool,
}

/// All kinds, in the order of their turns.
const KINDS: [Kind; 4] = [
    Kind { fresh: 1, is_prefetched: false },
    Kind { fresh: 1, is_prefetched: true },
    Kind { fresh: TOUCHED, is_prefetched: false },
    Kind { fresh: TOUCHED, is_prefetched: true },
];
/// Number of answers of each kind that are compared with a direct solve, spread over the run.
const CHECKED: usize = 12;
/// Largest time of a touch of nodes that were prefetched, ms.
const PREFETCHED_BAR_MS: f64 = 2.0;
/// Largest time of a touch without prefetch, as a multiple of a sparse solve for each new node.
const SOLVES_BAR: f64 = 3.0;
/// Largest displacement of a fingertip along an axis, relative to the object's size.
const REACH: f64 = 0.02;

/// All trials of one kind on one object.
struct Case {
    kind: Kind,
    trials: Vec<Trial>,
    /// Errors of the answers that were compared with a direct solve.
    errors: Vec<f64>,
}

/// Trials of all kinds on one object.
struct Size {
    nodes: usize,
    surface_nodes: usize,
    solves_ms: Spread,
    cases: Vec<Case>,
}

/// Measures the first frame of random grips.
///
/// # Errors
/// [`ReportError`], also for an answer that differs from the direct solve.
pub fn measure(options: &Options, report: &mut Report) -> Result<(), ReportError> {
    let sizes: &[usize] = if options.is_quick { &[125] } else { &[1000, 3375, 10_648] };
    let threads = processors();
    let mut measured = Vec::new();
    for &nodes in sizes {
        measured.push(one_size(nodes, threads, options.is_quick)?);
    }
    report.text(INTRODUCTION);
    report.text(verdicts(&measured));
    report.table(table(&measured));
    let caption = "Share of first frames that take longer, on the largest object.";
    report.figure("latency-onset", caption, curve(&measured)?);
    Ok(())
}

fn one_size(nodes: usize, threads: usize, is_quick: bool) -> Result<Size, ReportError> {
    let (rounds_min, rounds_max, seconds) = if is_quick { (6, 12, 1) } else { (100, 250, 75) };
    let scene = Pressed::try_new(BuiltIn::Cube, nodes)?;
    progress("onset", &format!("{} nodes", scene.mesh.node_count()));
    let pool = pool(threads)?;
    let (model, _) = scene.model()?;
    let solve = pool.install(|| SparseSolve::try_new(&scene, &model))?;
    let host = Host::open(&ServerChoice::Embedded, Some(threads))?;
    let mut cases: Vec<Case> =
        KINDS.map(|kind| Case { kind, trials: Vec::new(), errors: Vec::new() }).into();
    let (mut solves_ms, mut kept) = (Vec::new(), Vec::new());
    let (start, budget) = (Instant::now(), Duration::from_secs(seconds));
    let mut session = Session::start(&host, &scene, 0)?;
    for round in 0..rounds_max {
        if round >= rounds_min && start.elapsed() > budget {
            break;
        }
        if !session.can_go_on() {
            session = Session::start(&host, &scene, round as u64)?;
        }
        // Each round another kind begins.
        for turn in 0..cases.len() {
            let at = (round + turn) % cases.len();
            let case = &mut cases[at];
            let Some((grip, trial, displacement)) = session.touch(case.kind)? else { continue };
            case.trials.push(trial);
            if round % rounds_min.div_ceil(CHECKED) == 0 && round < rounds_min {
                kept.push((at, grip, displacement));
            }
            solves_ms.push(pool.install(|| solve.once(7919 * solves_ms.len())));
        }
    }
    drop((session, host));
    for (at, grip, displacement) in kept {
        let error = pool.install(|| error_of(&scene, &model, &grip, &displacement))?;
        cases[at].errors.push(error);
    }
    Ok(Size {
        nodes: scene.mesh.node_count(),
        surface_nodes: scene.surface.nodes.len(),
        solves_ms: Spread::of(solves_ms),
        cases,
    })
}

/// One upload, and touches until the surface is used up.
struct Session<'a> {
    toucher: Toucher<'a>,
    grips: Grips,
    touches_left: bool,
}

impl<'a> Session<'a> {
    fn start(host: &Host, scene: &'a Pressed, seed: u64) -> Result<Self, ReportError> {
        let mut toucher = Toucher::try_new(host, scene)?;
        let mut grips = Grips::new(&scene.surface.nodes, REACH * scene.mesh.size(), seed);
        if let Some(first) = grips.draw(TOUCHED) {
            toucher.settle(&first)?;
        }
        // Shows how long a touch takes before the first rest depends on it.
        if let Some(second) = grips.draw(TOUCHED) {
            toucher.touch(&second, false)?;
        }
        Ok(Self { toucher, grips, touches_left: true })
    }

    fn can_go_on(&self) -> bool {
        self.touches_left
    }

    fn touch(&mut self, kind: Kind) -> Result<Option<(Grip, Trial, Vec<f64>)>, ReportError> {
        let Some(grip) = self.grips.draw(kind.fresh) else {
            self.touches_left = false;
            return Ok(None);
        };
        let (trial, displacement) = self.toucher.touch(&grip, kind.is_prefetched)?;
        Ok(Some((grip, trial, displacement)))
    }
}

impl Kind {
    fn name(self) -> String {
        let nodes = if self.fresh == 1 { "1 new node" } else { "5 new nodes" };
        let prefetch = if self.is_prefetched { "prefetched" } else { "not prefetched" };
        format!("{nodes}, {prefetch}")
    }
}

impl Case {
    fn tail(&self) -> Tail {
        Tail::of(self.trials.iter().map(|t| t.ms))
    }

    /// Median, relative to the sparse solves that the limit allows for each new node.
    fn over_bar(&self, solve_ms: f64) -> f64 {
        let allowed = SOLVES_BAR * self.kind.fresh as f64 * solve_ms;
        Spread::of(self.trials.iter().map(|t| t.ms)).median / allowed
    }
}

fn verdicts(measured: &[Size]) -> String {
    let mut text = format!(
        "Bars: with prefetch at most {PREFETCHED_BAR_MS} ms; without, at most {SOLVES_BAR} sparse \
         solves for each new node.\n\n"
    );
    for size in measured {
        for case in &size.cases {
            let median = Spread::of(case.trials.iter().map(|t| t.ms)).median;
            let over = case.over_bar(size.solves_ms.median);
            let (is_reached, beside) = match case.kind.is_prefetched {
                true => (
                    case.tail().p99.unwrap_or(median) <= PREFETCHED_BAR_MS,
                    format!("p99 {} ms", case.tail().p99.map_or("–".to_owned(), three_digits)),
                ),
                false => (
                    over <= 1.0,
                    format!("{} sparse solves a new node", three_digits(SOLVES_BAR * over)),
                ),
            };
            let word = if is_reached { "reached" } else { "**not reached**" };
            text.push_str(&format!(
                "- {} nodes, {}: median {} ms, {beside}: {word}\n",
                size.nodes,
                case.kind.name(),
                three_digits(median),
            ));
        }
    }
    text
}

fn table(measured: &[Size]) -> Table {
    let title = "From sending the first frame of a grip to its answer";
    let mut table = Table::new("latency-onset", title, &COLUMNS);
    for size in measured {
        for case in &size.cases {
            let tail = case.tail();
            let stage = |of: fn(&Trial) -> f64| Spread::of(case.trials.iter().map(of)).median;
            let row: [Cell; 17] = [
                size.nodes.into(),
                size.surface_nodes.into(),
                case.kind.fresh.into(),
                if case.kind.is_prefetched { "yes" } else { "no" }.into(),
                case.trials.len().into(),
                tail.p50.into(),
                tail.p99.into(),
                tail.max.into(),
                stage(|t| t.stages.queue).into(),
                stage(|t| t.stages.factor).into(),
                stage(|t| t.stages.solve).into(),
                size.solves_ms.median.into(),
                size.solves_ms.p90.into(),
                (SOLVES_BAR * case.over_bar(size.solves_ms.median)).into(),
                Spread::of(case.trials.iter().map(|t| t.residual_rel)).max.into(),
                Spread::of(case.errors.iter().copied()).max.into(),
                case.errors.len().into(),
            ];
            table.push(row);
        }
    }
    table
}

fn curve(measured: &[Size]) -> Result<String, ReportError> {
    let largest = measured.last();
    let series = largest.into_iter().flat_map(|size| &size.cases).map(|case| Series {
        label: case.kind.name(),
        mark: Mark::Line,
        points: longer_than(case.trials.iter().map(|t| t.ms)),
    });
    let plot = Plot {
        title: format!("First frame of a grip, {} nodes", largest.map_or(0, |s| s.nodes)),
        x_label: "ms".to_owned(),
        y_label: "share that takes longer".to_owned(),
        x_scale: Scale::Log,
        y_scale: Scale::Log,
        series: series.collect(),
    };
    Ok(plot.svg()?)
}

const COLUMNS: [&str; 17] = [
    "nodes",
    "surface_nodes",
    "new_nodes",
    "prefetched",
    "grips",
    "p50_ms",
    "p99_ms",
    "max_ms",
    "queue_ms",
    "factor_ms",
    "solve_ms",
    "sparse_solve_ms",
    "sparse_solve_p90_ms",
    "sparse_solves_per_new_node",
    "residual_rel",
    "error_rel",
    "compared",
];

const INTRODUCTION: &str = "\
An embedded server, over a loopback socket with TCP_NODELAY, keeps the cube. A grip is five random \
surface nodes with random displacements; either one of them or all five have never been named \
before, the others are random nodes whose columns are kept. Timed is the first frame of the grip, \
from sending it to having the displacements of all surface nodes in double precision. With prefetch \
the new nodes are named first, as the client does when a fingertip comes near, and the frame follows \
after a rest of at least three times the slowest of the latest eight touches; the same rest is before every touch, \
so that nothing else is worked on. The four kinds take turns. When the surface is used up the model \
is dropped and sent anew, and its proof waited for.

A sparse solve is one right-hand side through the factor of `front` of the same shape, timed after \
every touch on a pool of as many threads. A new node needs three columns, each at least such a solve.

Every answer has to have its touched nodes where they were put and a residual below 1e-9; a dozen of \
each kind are compared with a direct solve by `front` with the same nodes known, and above 1e-9 the \
report ends.";
