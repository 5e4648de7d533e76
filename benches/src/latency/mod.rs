//! Report `latency`: times of frame questions: warm ones, the first of a grip, one each millisecond.

mod frame;
mod hold;
mod onset;

use crate::report::{Options, Report, ReportError};
use crate::threads::processors;

/// Measures the report.
///
/// # Errors
/// [`ReportError`], also for an answer that differs from the exact one.
pub fn measure(options: &Options) -> Result<Report, ReportError> {
    let title = "Latency: how soon a frame is answered";
    let mut report = Report::begin("latency", title, &processors().to_string(), options);
    report.chapter("Warm frames: round trip against an echo of the same bytes");
    frame::measure(options, &mut report)?;
    report.chapter("The first frame of a new grip");
    onset::measure(options, &mut report)?;
    report.chapter("A request every millisecond");
    hold::measure(options, &mut report)?;
    Ok(report)
}
