//! The report: energy created and error of the force against delay, jitter and loss, by how answers are
//! rendered; then rates.

use softgrasp_force::DeviceLimits;

use super::rates;
use super::rendered::{Felt, How, Wire, feel};
use super::served::{Served, ServedPath};
use crate::plot::{Mark, Plot, PlotPoint, Scale, Series};
use crate::report::{Options, Report, ReportError, progress};
use crate::table::{Cell, Table};

/// Energy that rounding may create, J, beside the reserve.
const ROUNDING: f64 = 1e-9;
/// Delay up to which the bar holds, ms.
const DELAY_OF_BAR: usize = 20;

/// Measures the report.
///
/// # Errors
/// [`ReportError`].
pub fn measure(options: &Options) -> Result<Report, ReportError> {
    let title = "What a hand feels of late answers: energy and error of the force";
    let mut report = Report::begin("felt", title, "1", options);
    // The device answers at once here: positions and forces meet in time.
    let limits = DeviceLimits { delay: 0.0, ..DeviceLimits::desktop() };
    let compliance = 1.0 / DeviceLimits::desktop().stiffness_max();
    let (nodes, frequencies): (usize, &[f64]) =
        if options.is_quick { (200, &[2.0]) } else { (1000, &[0.5, 1.0, 2.0, 5.0, 10.0]) };
    let ball = Served::try_new(nodes)?;
    let mut paths = Vec::new();
    for &frequency in frequencies {
        progress("felt", &format!("answers along a path of {frequency} Hz"));
        let cycles = if options.is_quick { 1 } else { (2.0 * frequency).ceil() as usize };
        paths.push(ball.play(frequency, cycles.max(1), compliance)?);
    }
    let mut table = Table::new("felt", "Energy and error by delay, jitter and loss", &COLUMNS);
    let mut series: Vec<Series> = Vec::new();
    for wire in wires(options.is_quick) {
        for how in How::ALL {
            let felt = worst(&paths, how, wire, limits);
            table.push(row(how, wire, &felt));
            if how == How::Whole
                && wire.delay_ms <= DELAY_OF_BAR
                && felt.created > limits.reserve + ROUNDING
            {
                report.fault(format!("{wire:?}: {:e} J created", felt.created));
            }
            if wire.jitter_ms == 0 && wire.loss == 0.0 {
                add(&mut series, how, wire.delay_ms as f64, 1e3 * (-felt.given).max(1e-6));
            }
        }
    }
    report.text(introduction(ball.node_count()));
    report.table(table);
    let plot = Plot {
        title: "Energy that a hand is given on a closed path".to_owned(),
        x_label: "delay of the answers, ms".to_owned(),
        y_label: "mJ, the worst path; 0.001 for none".to_owned(),
        x_scale: Scale::Log,
        y_scale: Scale::Log,
        series,
    };
    report.figure(
        "felt",
        "Energy given to the hand against the delay of the answers.",
        plot.svg()?,
    );
    report.text(RATES);
    report.table(rates::table(options.is_quick)?);
    Ok(report)
}

/// Delays alone, then jitter and loss at some of them.
fn wires(is_quick: bool) -> Vec<Wire> {
    let plain = |delay_ms| Wire { delay_ms, jitter_ms: 0, loss: 0.0 };
    if is_quick {
        return vec![plain(1), Wire { delay_ms: 20, jitter_ms: 5, loss: 0.05 }];
    }
    let mut wires: Vec<Wire> = [1, 2, 5, 10, 20, 30, 50].map(plain).to_vec();
    for delay_ms in [5, 20, 50] {
        wires.push(Wire { delay_ms, jitter_ms: delay_ms / 2, loss: 0.0 });
        wires.push(Wire { delay_ms, jitter_ms: 0, loss: 0.01 });
        wires.push(Wire { delay_ms, jitter_ms: delay_ms / 2, loss: 0.05 });
    }
    wires
}

/// The worst figures of all paths.
fn worst(paths: &[ServedPath], how: How, wire: Wire, limits: DeviceLimits) -> Felt {
    let mut worst = Felt { given: f64::INFINITY, ..Felt::default() };
    for path in paths {
        let felt = feel(path, how, wire, limits);
        worst.given = worst.given.min(felt.given);
        worst.created = worst.created.max(felt.created);
        if felt.error_rms > worst.error_rms {
            (worst.error_rms, worst.force_rms) = (felt.error_rms, felt.force_rms);
        }
        worst.error_max = worst.error_max.max(felt.error_max);
    }
    worst
}

fn row(how: How, wire: Wire, felt: &Felt) -> Vec<Cell> {
    vec![
        how.name().into(),
        wire.delay_ms.into(),
        wire.jitter_ms.into(),
        (100.0 * wire.loss).into(),
        (1e3 * felt.given).into(),
        (1e3 * felt.created.max(0.0)).into(),
        felt.error_rms.into(),
        felt.error_max.into(),
        felt.force_rms.into(),
    ]
}

fn add(series: &mut Vec<Series>, how: How, x: f64, y: f64) {
    let point = PlotPoint { x, y, spread: None };
    match series.iter_mut().find(|series| series.label == how.name()) {
        Some(series) => series.points.push(point),
        None => {
            let label = how.name().to_owned();
            series.push(Series { label, mark: Mark::Line, points: vec![point] });
        }
    }
}

const COLUMNS: [&str; 9] = [
    "rendered",
    "delay_ms",
    "jitter_ms",
    "loss_percent",
    "given_mJ",
    "created_mJ",
    "error_rms_N",
    "error_max_N",
    "force_rms_N",
];

fn introduction(nodes: usize) -> String {
    format!(
        "A fingertip presses a ball of 70 mm ({nodes} nodes, 50 kPa) on a table by 7 mm and 2 mm aside, and \
         comes back, 0.5 to 10 times a second. The steps are those of a run, one for every 16 ms that is asked \
         for when the one before has come; time is counted, not measured. The finger gives way by 3 mm/N, as \
         with `--force haply`. `given_mJ` is the least that a hand gives on a closed path; what is below zero \
         it was given. `created_mJ` is the most that was given beyond what a damping of 0.5 N s/m takes; the \
         last way promises at most 1 mJ. Errors are against what the server answers, later, to the hand of \
         that moment; `force_rms_N` is that answer. Each figure is that of the worst path."
    )
}

const RATES: &str = "\
Runs of `glove-client run --grasp contact --hand scripted:lift --rate 60 --force record:F` with a server \
in a process of its own on the same machine. `late` are ticks of the force that began more than half a \
millisecond late, or not at all.
";
