//! Writes the page: rate of the factor relative to the rate of a product, against the size.

use softgrasp_core::solve::FrontPrecision;

use super::one_size::{Rounds, table};
use super::round::{Problem, Round};
use crate::plot::{Mark, Plot, PlotPoint, Scale, Series};
use crate::report::{Options, Report, ReportError, progress};
use crate::sample::Spread;
use crate::table::{Cell, Table};
use crate::threads::{pool, processors};

/// Numbers of nodes of the cubes.
const NODES: [usize; 7] = [1000, 3375, 10_648, 21_952, 46_656, 97_336, 157_464];
/// Number of nodes above which a round is long enough to be made once only.
const LARGE: usize = 40_000;
/// Number of nodes of the cube that is measured in detail.
const IN_DETAIL: usize = 10_648;
/// Number of nodes above which one thread alone would take minutes.
const ALL_THREADS: usize = 60_000;

/// Factors cubes of growing size.
///
/// # Errors
/// [`ReportError`], also for a wrong answer.
pub fn measure(options: &Options) -> Result<Report, ReportError> {
    let sizes = if options.is_quick { &NODES[..1] } else { &NODES[..] };
    let all = processors();
    let threads: Vec<usize> = if all > 1 { vec![1, all] } else { vec![1] };
    let title = "At the machine's limit: factor, one request, many right-hand sides";
    let mut report = Report::begin("limits", title, &format!("{threads:?}"), options);
    let mut detail = None;
    let mut cubes = Table::new("limits-cubes", "Factors of cubes", &COLUMNS);
    let mut series: Vec<Series> = Vec::new();
    for &nodes in sizes {
        progress("limits", &format!("{nodes} nodes"));
        let problem = Problem::try_new(nodes)?;
        let rounds = match (options.is_quick, nodes > LARGE) {
            (true, _) | (_, true) => 1,
            _ => 5,
        };
        let mut doubles: Vec<Vec<Round>> = threads.iter().map(|_| Vec::new()).collect();
        let mut singles: Vec<Vec<Round>> = threads.iter().map(|_| Vec::new()).collect();
        // In turn, so that a busy spell of the machine hits all of them alike.
        for _ in 0..rounds {
            let taken = threads.iter().enumerate();
            for (k, &threads) in taken.filter(|(_, t)| **t == all || nodes < ALL_THREADS) {
                doubles[k].push(round::<f64>(&problem, threads, 1e-10)?);
                singles[k].push(round::<f32>(&problem, threads, 1e-2)?);
            }
        }
        if problem.nodes == IN_DETAIL || options.is_quick {
            let all = threads.len() - 1;
            let rounds = Rounds {
                doubles: [&doubles[0], &doubles[all]],
                singles: [&singles[0], &singles[all]],
            };
            detail = Some(table(&problem, &rounds, options.is_quick)?);
        }
        for (k, &threads) in threads.iter().enumerate() {
            add::<f64>(&mut cubes, &mut series, "f64", threads, problem.nodes, &doubles[k]);
            add::<f32>(&mut cubes, &mut series, "f32", threads, problem.nodes, &singles[k]);
        }
    }
    if let Some(detail) = detail {
        report.text(IN_DETAIL_TEXT);
        report.table(detail);
    }
    report.text(INTRODUCTION);
    report.table(cubes);
    let plot = Plot {
        title: "Rate of the factor over the rate of a product".to_owned(),
        x_label: "nodes".to_owned(),
        y_label: "factor over product".to_owned(),
        x_scale: Scale::Log,
        y_scale: Scale::Linear,
        series,
    };
    report.figure("limits", "Factor in memory it has, over faer's product.", plot.svg()?);
    Ok(report)
}

fn round<T: FrontPrecision + faer::traits::RealField + From<f32>>(
    problem: &Problem,
    threads: usize,
    residual_allowed: f64,
) -> Result<Round, ReportError> {
    pool(threads)?.install(|| Round::take::<T>(problem, threads, residual_allowed))
}

/// Adds one row, and one point of the figure.
fn add<T: FrontPrecision>(
    table: &mut Table,
    series: &mut Vec<Series>,
    precision: &str,
    threads: usize,
    nodes: usize,
    rounds: &[Round],
) {
    let Some(last) = rounds.last() else { return };
    let of = |value: fn(&Round) -> f64| Spread::of(rounds.iter().map(value));
    let (product, again) = (of(|r| r.product), of(|r| r.again));
    let gflop = last.analysis.flops() / 1e9;
    // Both are of the same round.
    let share = Spread::of(rounds.iter().map(|r| r.analysis.flops() / 1e6 / r.again / r.product));
    let mega = |bytes: usize| Cell::Number(bytes as f64 / f64::from(1 << 20));
    let mut row = vec![
        Cell::Count(nodes as u64),
        Cell::Text(precision.to_owned()),
        Cell::Count(threads as u64),
        Cell::Number(gflop),
        Cell::Number(product.median),
        Cell::Number(gflop / again.median * 1e3),
        Cell::Number(share.median),
        Cell::Number(share.min),
        Cell::Number(share.max),
    ];
    for value in [of(|r| r.order), of(|r| r.first), again, of(|r| r.solve)] {
        row.push(Cell::Number(value.median));
    }
    row.push(mega(last.analysis.factor_bytes::<T>()));
    row.push(mega(last.analysis.peak_bytes::<T>()));
    row.push(Cell::Number(of(|r| r.residual).max));
    row.push(Cell::Count(rounds.len() as u64));
    table.push(row);
    let label = format!("{precision}, {threads} thread{}", if threads == 1 { "" } else { "s" });
    let point = PlotPoint {
        x: nodes as f64,
        y: share.median,
        spread: (rounds.len() > 1).then_some((share.min, share.max)),
    };
    match series.iter_mut().find(|series| series.label == label) {
        Some(series) => series.points.push(point),
        None => series.push(Series { label, mark: Mark::Line, points: vec![point] }),
    }
}

const COLUMNS: [&str; 17] = [
    "nodes",
    "precision",
    "threads",
    "gflop",
    "product_gflops",
    "factor_gflops",
    "over_product",
    "over_product_min",
    "over_product_max",
    "order_ms",
    "first_ms",
    "again_ms",
    "solve_ms",
    "factor_mib",
    "peak_mib",
    "residual_rel",
    "rounds",
];

const INTRODUCTION: &str = "\
`K11` of cubes of linear tetrahedra, five nodes known, factored over fronts. `product_gflops` is the \
best rate of five products of two matrices of 1500 rows by faer on the same threads, measured in the \
same round just before; `over_product` is the factor's rate over it. `first` is the first factor of a pattern, \
whose memory the system hands out page by page; `again` the same with other values in the memory that \
is there, as in every step at large deformation; the rates are of that. `solve` is one right-hand side. \
`peak` is the most that can be held while a factor is made, on any number of threads, the factor \
included. The operations are those of the fronts, with the zeros that merging takes in. Every factor \
solves one right-hand side, whose residual is in the table.
";

const IN_DETAIL_TEXT: &str = "\
The cube of 10 648 nodes: medians of this run with the smallest and the largest. Times are in \
ms. `first` is a factor in memory \
that the system hands out page by page, `again` one in memory that is there. 21 loads are solved by \
`Factored::solve_several`: right-hand sides, solves, refinement and reactions; answers of both \
precisions agree to 1e-11. The last rows are stages that `glove-client solve` reports in a process of \
its own, whose `solve` also finds condition, certainty and the strain of all elements, which \
`--no-estimate` leaves out.
";
