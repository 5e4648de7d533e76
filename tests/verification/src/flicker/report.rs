//! The table of report `flicker`.

use softgrasp_grasp::grasp::{Grasp, StateName};

use super::trial::{RATE_HZ, Stage};
use softgrasp_bench::report::{Options, Report, ReportError, progress};
use softgrasp_bench::table::{Cell, Table};

/// Release margins that are tried, m.
const MARGINS_M: [f64; 8] = [0.0, 0.0005, 0.001, 0.002, 0.0025, 0.003, 0.004, 0.006];
/// Release margin of the product, m.
const PRODUCT: f64 = Grasp::RELEASE_MARGIN_M;

/// Measures the report.
///
/// # Errors
/// [`ReportError`].
pub fn measure(options: &Options) -> Result<Report, ReportError> {
    let mut report =
        Report::begin("flicker", "Noise of the devices against hysteresis", "1", options);
    let (seeds, minutes) = if options.is_quick { (1, 0.1) } else { (20, 1.0) };
    let ticks = (minutes * 60.0 * RATE_HZ) as u64;
    report.text(format!(
        "A scripted hand grasps the strawberry of the default run until the state is reached, and \
         rests there for {minutes} min at {RATE_HZ} ticks per second, {seeds} times with other \
         noise: tracker 0.8 mm and 0.15° (standard deviation, each axis), every sensor of the \
         glove off by −1, 0 or +1 count. It rests at the very first touch, which is the worst \
         place. Counted are changes of the state of the grasp. `release_ms`: from the tick in \
         which the hand begins to open, without noise, to the tick in which the object is not \
         deformed any more, blank where a smaller margin had let go before; the differences are the \
         price of the margin. All margins follow the same bytes, \
         those of a hand that saw the product's grasp: with the smallest margins the grasp drops out \
         of the state before the noise begins, which leaves little to change. The product has a margin of {} mm.",
        1e3 * PRODUCT
    ));
    let columns =
        ["margin_mm", "attached_changes_per_min", "deforming_changes_per_min", "release_ms"];
    let mut table = Table::new("flicker", "Changes by margin", &columns);
    let stage = Stage::strawberry().map_err(ReportError::Hand)?;
    for margin_m in MARGINS_M {
        progress("flicker", &format!("margin {} mm", 1e3 * margin_m));
        let mut rates = Vec::new();
        for state in [StateName::Attached, StateName::Deforming] {
            let mut changes = 0;
            for seed in 1..=seeds {
                let of_seed = stage.changes(margin_m, state, ticks, seed);
                changes += of_seed.map_err(ReportError::Hand)?;
            }
            rates.push(changes as f64 / (seeds as f64 * minutes));
        }
        let release_s = stage.release_s(margin_m).map_err(ReportError::Hand)?;
        let release = release_s.map_or(Cell::Blank, |s| Cell::Number(1e3 * s));
        let row = [1e3 * margin_m, rates[0], rates[1]].map(Cell::Number);
        table.push(row.into_iter().chain([release]));
        if margin_m == PRODUCT && rates.iter().any(|rate| *rate > 0.0) {
            report.fault(format!("margin {} mm: the state flickers", 1e3 * margin_m));
        }
    }
    report.table(table);
    Ok(report)
}
