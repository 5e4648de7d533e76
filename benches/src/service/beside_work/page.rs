//! Page of the report: its limits, and the sections that measure them.

use super::bars::Bars;
use super::{beside, receiving};
use crate::programs::Programs;
use crate::report::{Options, Report, ReportError};

/// Measures the report.
///
/// # Errors
/// [`ReportError`].
pub fn measure(options: &Options, report: &mut Report) -> Result<(), ReportError> {
    let programs = Programs::find()?;
    let mut bars = Bars::new(report, options.is_quick);
    beside::measure(&programs, &mut bars)?;
    receiving::measure(&programs, &mut bars)?;
    bars.write();
    Ok(())
}
