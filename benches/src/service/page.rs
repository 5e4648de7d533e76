//! The report: its bars, and the sections that measure them.

use super::bars::Bars;
use super::{beside, receiving};
use crate::programs::Programs;
use crate::report::{Options, Report, ReportError};
use crate::threads::processors;

/// Measures the report.
///
/// # Errors
/// [`ReportError`].
pub fn measure(options: &Options) -> Result<Report, ReportError> {
    let title = "What one client's long work costs the others";
    let mut report = Report::begin("service", title, &processors().to_string(), options);
    let programs = Programs::find()?;
    let mut bars = Bars::new(&mut report, options.is_quick);
    beside::measure(&programs, &mut bars)?;
    receiving::measure(&programs, &mut bars)?;
    bars.write();
    Ok(report)
}
