//! Writes report `large`.

use softgrasp_core::mesh::BuiltIn;

use super::frames::{Linear, Measured, Truth, linear, play};
use super::rates::hold_rate;
use super::squeeze::Squeeze;
use super::trust;
use super::walk::Walk;
use crate::plot::{Mark, Plot, PlotPoint, Scale, Series};
use crate::report::{Options, Report, ReportError, progress};
use crate::table::{Cell, Table, three_digits};
use crate::threads::{pool, processors};

/// Error budgets of the table of budgets.
const BUDGETS: [f64; 10] = [1e-1, 3e-2, 1e-2, 5e-3, 2e-3, 1e-3, 1e-4, 1e-6, 1e-8, 1e-10];
/// Objects of the table of objects, with their Poisson's ratios.
const OBJECTS: [(BuiltIn, f64); 5] = [
    (BuiltIn::Strawberry, 0.4),
    (BuiltIn::Sphere, 0.45),
    (BuiltIn::Cube, 0.3),
    (BuiltIn::Toothpaste, 0.4),
    (BuiltIn::Strawberry, 0.45),
];
/// Error budgets, each with the largest time of a frame as a multiple of a solve by `front` in single
/// precision.
const BARS: [(f64, f64); 2] = [(2e-3, 6.0), (1e-8, 16.0)];

const COLUMNS: [&str; 21] = [
    "object",
    "poisson",
    "nodes",
    "frames",
    "depth",
    "budget",
    "frame_ms",
    "frame_ms_p90",
    "solve_ms",
    "frame_over_solve",
    "solves",
    "solves_max",
    "error",
    "error_max",
    "estimate_max",
    "error_over_estimate",
    "over_twice",
    "elsewhere",
    "refused",
    "factors",
    "factor_ms_max",
];

/// Measures the report.
///
/// # Errors
/// [`ReportError`]; a frame without equilibrium is one.
pub fn measure(options: &Options) -> Result<Report, ReportError> {
    let threads = processors();
    let title = "Large deformation: error against time of frames";
    let mut report = Report::begin("large", title, &threads.to_string(), options);
    report.text(INTRODUCTION);
    let pool = pool(threads)?;
    let (budgets, series) = pool.install(|| by_budget(options, &mut report))?;
    let objects = pool.install(|| by_object(options))?;
    report.table(budgets);
    if !series.is_empty() {
        let plot = Plot {
            title: "Strawberry, 20 frames a squeeze".to_owned(),
            x_label: "time of a frame, ms".to_owned(),
            y_label: "largest error over largest displacement".to_owned(),
            x_scale: Scale::Log,
            y_scale: Scale::Log,
            series,
        };
        report.figure(
            "large",
            "Median time and median true error of a frame by budget.",
            plot.svg()?,
        );
    }
    report.text(OBJECTS_TEXT);
    report.table(objects);
    let (estimates, left_out) = pool.install(|| trust::table(options))?;
    report.text(ESTIMATES_TEXT);
    report.table(estimates);
    left_out.into_iter().for_each(|line| report.text(line));
    report.text(RATES_TEXT);
    let held = rates(options, threads, &mut report)?;
    report.table(held);
    report.text(WALKS_TEXT);
    let walked = pool.install(|| walks(options, &mut report))?;
    report.table(walked);
    Ok(report)
}

/// Measures every error budget on four sizes of one object.
fn by_budget(options: &Options, report: &mut Report) -> Result<(Table, Vec<Series>), ReportError> {
    let sizes: &[usize] = if options.is_quick { &[125] } else { &[216, 1000, 3375, 10_648] };
    let mut table = Table::new("large", "Frames by budget, strawberry", &COLUMNS);
    let mut verdicts = String::new();
    let mut series = Vec::new();
    for &nodes in sizes {
        let squeeze = Squeeze::new(BuiltIn::Strawberry, nodes, 0.4)?;
        let truth = Truth::new(&squeeze, 20)?;
        let mut points = Vec::new();
        for budget in BUDGETS {
            progress("large", &format!("{nodes} nodes, budget {budget:.0e}"));
            let measured = play(&squeeze, &truth, budget)?;
            table.push(row(("strawberry", 0.4), &squeeze, truth.frames, budget, &measured));
            points.push(PlotPoint {
                x: measured.ms.median,
                y: measured.error.median.max(1e-14),
                spread: None,
            });
            if let Some((_, most)) = BARS.iter().find(|(of, _)| *of == budget) {
                verdicts.push_str(&verdict(nodes, budget, *most, &measured));
            }
        }
        let Linear { ms, error, bytes } = linear(&squeeze, &truth)?;
        verdicts.push_str(&format!(
            "- {nodes} nodes, linear answer (condensed, every node): {} ms, true error {} (median), \
             {} (most); kept beside the model: {} MB\n",
            three_digits(ms.median),
            three_digits(error.median),
            three_digits(error.max),
            three_digits(bytes as f64 / 1e6)
        ));
        series.push(Series { label: format!("{nodes} nodes"), mark: Mark::Line, points });
        let point = PlotPoint { x: ms.median, y: error.median, spread: None };
        series.push(Series {
            label: format!("{nodes}, linear"),
            mark: Mark::Points,
            points: vec![point],
        });
    }
    report.text(verdicts);
    Ok((table, series))
}

/// Measures two error budgets on five objects and at three speeds of the hand.
fn by_object(options: &Options) -> Result<Table, ReportError> {
    let (nodes, speeds): (usize, &[usize]) =
        if options.is_quick { (125, &[20]) } else { (1000, &[20, 60, 200]) };
    let mut table = Table::new("large-objects", "Frames by object and speed", &COLUMNS);
    for (shape, poisson) in OBJECTS {
        let mut squeeze = Squeeze::new(shape, nodes, poisson)?;
        // Thin parts cannot be pressed as deep: half as deep, until there is an equilibrium.
        let truths = loop {
            let truths: Result<Vec<Truth>, ReportError> =
                speeds.iter().map(|&frames| Truth::new(&squeeze, frames)).collect();
            match truths {
                Err(ReportError::NoEquilibrium(_)) => squeeze = squeeze.gentler(),
                truths => break truths?,
            }
        };
        for truth in truths {
            let frames = truth.frames;
            progress("large", &format!("{shape} {poisson}, {frames} frames"));
            for (budget, _) in BARS {
                let measured = play(&squeeze, &truth, budget)?;
                let name = shape.to_string();
                table.push(row((&name, poisson), &squeeze, frames, budget, &measured));
            }
        }
    }
    Ok(table)
}

fn row(
    (object, poisson): (&str, f64),
    squeeze: &Squeeze,
    frames: usize,
    budget: f64,
    measured: &Measured,
) -> [Cell; 21] {
    [
        Cell::Text(object.to_owned()),
        Cell::Number(poisson),
        Cell::Count(squeeze.model.mesh().node_count() as u64),
        Cell::Count(frames as u64),
        Cell::Number(squeeze.depth()),
        Cell::Number(budget),
        Cell::Number(measured.ms.median),
        Cell::Number(measured.ms.p90),
        Cell::Number(measured.solve_ms.median),
        Cell::Number(measured.ratio.median),
        Cell::Number(measured.solves.median),
        Cell::Number(measured.solves.max),
        Cell::Number(measured.error.median),
        Cell::Number(measured.error.max),
        Cell::Number(measured.estimate_max),
        Cell::Number(measured.error_over_estimate),
        Cell::Count(measured.over_twice as u64),
        Cell::Count(measured.elsewhere as u64),
        Cell::Count(measured.refused as u64),
        Cell::Count(measured.factors as u64),
        Cell::Number(measured.factor_ms),
    ]
}

fn verdict(nodes: usize, budget: f64, most: f64, measured: &Measured) -> String {
    let ratio = measured.ratio.median;
    let word = if ratio <= most { "met" } else { "not met" };
    format!(
        "- {nodes} nodes, budget {budget:.0e}: a frame takes {} solves of `front` in single precision \
         (bar {most}: {word}); path {} MB beside a model of {} MB\n",
        three_digits(ratio),
        three_digits(measured.bytes as f64 / 1e6),
        three_digits(measured.model_bytes as f64 / 1e6),
    )
}

fn rates(options: &Options, threads: usize, report: &mut Report) -> Result<Table, ReportError> {
    let columns = [
        "nodes",
        "rate_hz",
        "frames",
        "frame_ms",
        "p99_ms",
        "max_ms",
        "first_frame_ms",
        "solves",
        "estimate_max",
        "factor_age_max",
    ];
    let mut table = Table::new("large-rates", "A moving hand over the socket", &columns);
    let asked: &[(usize, f64, usize)] = match options.is_quick {
        true => &[(125, 100.0, 40)],
        false => &[(1000, 100.0, 1200), (1000, 60.0, 720), (10_648, 15.0, 180)],
    };
    for &(nodes, rate_hz, frames) in asked {
        progress("large", &format!("{nodes} nodes at {rate_hz} Hz"));
        let held = hold_rate(nodes, rate_hz, frames, threads)?;
        table.push([
            Cell::Count(held.nodes as u64),
            Cell::Number(held.rate_hz),
            Cell::Count(held.frames as u64),
            Cell::Number(held.ms.median),
            Cell::Number(held.p99_ms),
            Cell::Number(held.ms.max),
            Cell::Number(held.first_ms),
            Cell::Number(held.solves.median),
            Cell::Number(held.estimate_max),
            Cell::Count(u64::from(held.factor_age_max)),
        ]);
        if held.estimate_max > 2e-3 {
            report.fault(format!("{nodes} nodes at {rate_hz} Hz: an estimate above the budget"));
        }
    }
    Ok(table)
}

fn walks(options: &Options, report: &mut Report) -> Result<Table, ReportError> {
    let columns = [
        "object",
        "poisson",
        "nodes",
        "steps",
        "regrasps",
        "refused",
        "jumps",
        "jacobian_min",
        "solves_max",
        "same_bits_again",
    ];
    let mut table = Table::new("large-walks", "Random walks of the hand", &columns);
    let (nodes, steps): (&[usize], u64) =
        if options.is_quick { (&[60], 20) } else { (&[125, 400], 1000) };
    for (at, (shape, poisson)) in OBJECTS.into_iter().enumerate() {
        for &nodes in nodes {
            progress("large", &format!("walk round {shape} {poisson}, {nodes} nodes"));
            let begun = || Walk::new(shape, nodes, poisson, at as u64 + 1);
            let mut walk = begun()?;
            let fault = (0..steps).find_map(|_| walk.step().err());
            let (mut once, mut again) = (begun()?, begun()?);
            for _ in 0..steps / 10 {
                // Faults are those of the whole walk.
                let _ = (once.step(), again.step());
            }
            let same = once.count == again.count;
            let count = walk.count;
            if let Some(fault) = fault {
                report.fault(format!("walk round {shape}, {nodes} nodes: {fault}"));
            }
            if !same {
                report.fault(format!("walk round {shape}, {nodes} nodes: other bits again"));
            }
            table.push([
                Cell::Text(shape.to_string()),
                Cell::Number(poisson),
                Cell::Count(nodes as u64),
                Cell::Count(count.steps),
                Cell::Count(count.regrasps),
                Cell::Count(count.refused),
                Cell::Count(count.jumps),
                Cell::Number(count.jacobian_min),
                Cell::Count(u64::from(count.solves_max)),
                Cell::Text(if same { "yes" } else { "no" }.to_owned()),
            ]);
        }
    }
    Ok(table)
}

const INTRODUCTION: &str = "\
Five tips hold parts of the surface (masks), press them in by 8 % of the object's size (15 % of its smallest extent where that is less) and turn by \
0.2 rad, in so many frames; law `neo-hookean`, linear tetrahedra, 20 kPa. `error` is the largest \
error of a displacement over the largest displacement, against a path in double precision whose \
residuals are rounding; `estimate_max` is what the frames said of themselves. A body that buckles has \
several equilibria: `elsewhere` counts frames that are on another branch than that path, whose error \
is the way to the equilibrium that they settle to; `refused` counts those for which none was found, `over_twice` those whose true error is more than twice \
its estimate. A \
frame is timed from \
the goal to the shape, factors that are made beside the frames excluded (`factors`, \
`factor_ms_max`); its first frame, which makes the first factor, is not among them. `solve_ms` is a \
solve of `front` in single precision of the same object, in turn with the frames.";
const OBJECTS_TEXT: &str = "\
The same for five objects and three speeds of the hand: 20, 60 and 200 frames for the same squeeze. `depth` is how deep the tips press, as a share of the size; where that has no equilibrium, because a thin part would turn inside out, the squeeze is halved until it has one.";
const ESTIMATES_TEXT: &str = "\
Three to five round patches of an object, drawn at random with material, law, depth (up to half of the \
smallest extent), turn, slide and speed, are pressed in; files of others and generated objects, the \
seeds are those of the program. Every frame is set beside the equilibrium that it settles to by \
itself. `judged` are the frames outside of a snap; `above` of them have a true error above the \
estimate, `over_twice` above twice the estimate.";
const RATES_TEXT: &str = "\
A hand squeezes in for two seconds and out for two seconds, again and again, at a rate, over a \
loopback socket, budget 2e-3, factors made beside the frames on a thread of their own. `first_frame_ms` \
is the first frame of the grip: order, elements, first factor.";
const WALKS_TEXT: &str = "\
A hand walks at random round an object: it presses up to 30 % of the size (56 % of the smallest extent where that is less), turns up to 1 rad, slides, \
rests, lets go and takes hold of less. No answer may have an element inside out, be no number or be \
above its budget; while the hand rests the energy may not rise; a step that is refused may not change \
the shape; and a tenth of the walk is walked twice more, with the same bits.";
