//! Report `methods`: time by stage of every method, its error beside it.

use std::time::Duration;

use softgrasp_core::mesh::BuiltIn;
use softgrasp_core::solve::Method;

use crate::reference::Reference;
use crate::report::{Options, Report, ReportError, check, progress};
use crate::sample::{Competitor, Effort, Spread, take_turns};
use crate::scene::Pressed;
use crate::stages::StageTimes;
use crate::table::{Cell, Table, three_digits};
use crate::threads::{pool, processors};

/// Largest error, relative to the reference, with which a time is reported.
const ERROR_ALLOWED: f64 = 1e-9;

/// One run of one method.
struct Run {
    times: StageTimes,
    residual_rel: f64,
    error_rel: f64,
}

/// Measures every method on the cube with five contacts.
///
/// # Errors
/// [`ReportError`].
pub fn measure(options: &Options) -> Result<Report, ReportError> {
    let sizes: &[usize] = if options.is_quick { &[64, 125] } else { &[216, 267, 343, 1000] };
    let threads = processors();
    let title = "Methods: time by stage, and error";
    let mut report = Report::begin("methods", title, &threads.to_string(), options);
    let mut table = Table::new("methods", "Cube with five contacts", &COLUMNS);
    let mut verdicts = String::new();
    for &nodes in sizes {
        let scene = Pressed::try_new(BuiltIn::Cube, nodes)?;
        let runs = run_all(&scene, threads, options.is_quick)?;
        add_rows(&mut table, &scene, &runs);
        verdicts.push_str(&verdict(&scene, &runs));
    }
    report.text(INTRODUCTION);
    report.table(table);
    report.text(format!(
        "### Against the plain Gauss–Jordan loop\n\n\
         Total time, in the same rounds. Bars at 1000 nodes: `gauss-jordan` by panels at least \
         5 ×, `dense-inverse` at least 10 ×.\n\n{verdicts}"
    ));
    Ok(report)
}

/// Every method in turn, in a pool of exactly `threads` threads.
fn run_all(scene: &Pressed, threads: usize, is_quick: bool) -> Result<Vec<Vec<Run>>, ReportError> {
    progress("methods", &format!("{} nodes", scene.mesh.node_count()));
    let pool = pool(threads)?;
    let (model, known) = scene.model()?;
    let reference = Reference::of(&model, &known)?;
    let mut competitors: Vec<Competitor<'_, Run, ReportError>> = Vec::new();
    for method in Method::DIRECT {
        let (pool, reference) = (&pool, &reference);
        competitors.push(Box::new(move || {
            let (times, solution) = pool.install(|| scene.analyse(method))?;
            let error_rel = reference.error_of(solution.displacement.iter().copied(), 1.0);
            check(
                || format!("{method} at {} nodes", scene.mesh.node_count()),
                error_rel,
                ERROR_ALLOWED,
            )?;
            Ok(Run { times, residual_rel: solution.residual_rel, error_rel })
        }));
    }
    take_turns(&effort(is_quick), &mut competitors)
}

fn effort(is_quick: bool) -> Effort {
    match is_quick {
        true => Effort {
            warm_up_rounds: 1,
            rounds_min: 3,
            rounds_max: 5,
            budget: Duration::from_secs(2),
        },
        false => Effort {
            warm_up_rounds: 1,
            rounds_min: 5,
            rounds_max: 25,
            budget: Duration::from_secs(60),
        },
    }
}

fn add_rows(table: &mut Table, scene: &Pressed, runs: &[Vec<Run>]) {
    for (method, runs) in Method::DIRECT.iter().zip(runs) {
        let stage = |of: fn(&StageTimes) -> f64| Spread::of(runs.iter().map(|r| of(&r.times)));
        let worst = |of: fn(&Run) -> f64| Spread::of(runs.iter().map(of)).max;
        let total = stage(|t| t.total);
        let row: [Cell; 13] = [
            method.name().into(),
            scene.mesh.node_count().into(),
            scene.unknown_dofs().into(),
            stage(|t| t.assemble).median.into(),
            stage(|t| t.order).median.into(),
            stage(|t| t.factor).median.into(),
            stage(|t| t.solve).median.into(),
            total.median.into(),
            total.min.into(),
            total.max.into(),
            worst(|r| r.residual_rel).into(),
            worst(|r| r.error_rel).into(),
            runs.len().into(),
        ];
        table.push(row);
    }
}

/// A line for each method that has a bar against the plain Gauss–Jordan loop.
fn verdict(scene: &Pressed, runs: &[Vec<Run>]) -> String {
    let total = |method: Method| -> Vec<f64> {
        let of = Method::DIRECT.iter().zip(runs).filter(|(m, _)| **m == method);
        of.flat_map(|(_, runs)| runs.iter().map(|r| r.times.total)).collect()
    };
    let nodes = scene.mesh.node_count();
    let line = |(method, bar): (Method, f64)| {
        let ratio = Spread::of_ratio(&total(Method::GaussJordanPlain), &total(method));
        let word = match (nodes >= 1000, ratio.median >= bar) {
            (false, _) => "",
            (true, true) => ": the bar is reached",
            (true, false) => ": **the bar is not reached**",
        };
        format!(
            "- {nodes} nodes, `{method}`: {} × (rounds from {} to {}){word}\n",
            three_digits(ratio.median),
            three_digits(ratio.min),
            three_digits(ratio.max)
        )
    };
    [(Method::GaussJordan, 5.0), (Method::DenseInverse, 10.0)].map(line).concat()
}

const COLUMNS: [&str; 13] = [
    "method",
    "nodes",
    "unknown_dofs",
    "assemble_ms",
    "order_ms",
    "factor_ms",
    "solve_ms",
    "total_ms",
    "total_min_ms",
    "total_max_ms",
    "residual_rel",
    "error_rel",
    "rounds",
];

const INTRODUCTION: &str = "\
Each round runs every method once, from the mesh to the displacements, and each round another \
method begins. Times are medians over the rounds; `total` also holds what no stage names (the \
search for free motions, copies). `factor` is the inverse where the method makes one.

`error_rel` is the largest difference of any displacement to a reference, over the largest \
displacement; the reference is refined with residuals in twice the working precision. Residual and \
error are the worst of all rounds. A method whose error is above 1e-9 ends the report.";
