//! Report `service`: what users of one server get: beside a running session, beside others' long work,
//! among many clients, from Python, among hostile ones, over restarts and an hour.

mod beside_work;
mod load;
mod python;
mod session;
mod trust;

use crate::report::{Options, Report, ReportError};
use crate::threads::processors;

/// Measures the report.
///
/// # Errors
/// [`ReportError`], also for a run that hangs and for a wrong answer.
pub fn measure(options: &Options) -> Result<Report, ReportError> {
    let title = "Service: what the users of one server get";
    let mut report = Report::begin("service", title, &processors().to_string(), options);
    report.chapter("What a user of `run` gets in real time");
    session::measure(options, &mut report)?;
    report.chapter("What one client's long work costs the others");
    beside_work::measure(options, &mut report)?;
    report.chapter("How many clients one server serves in time");
    load::measure(options, &mut report)?;
    report.chapter("How many frames a second Python gets");
    python::measure(options, &mut report)?;
    report.chapter("A server one can trust");
    trust::measure(options, &mut report)?;
    Ok(report)
}
