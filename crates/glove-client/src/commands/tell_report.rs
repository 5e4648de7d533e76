//! The end of a run: its report is written, its summary printed.

use std::path::Path;

use anyhow::bail;

use super::output::{print, write_json};
use crate::run::run_report::RunReport;
use crate::run::run_words::{describe, failure};

/// Writes and prints the report.
///
/// # Errors
/// One line: why the report cannot be written, or why the run failed.
pub(super) fn tell(path: Option<&Path>, report: &RunReport) -> anyhow::Result<()> {
    if let Some(path) = path {
        write_json(path, report)?;
    }
    // The reason comes first: whoever reads standard error and standard output together sees it.
    match failure(report) {
        Some(failure) => {
            print(&describe(report))?;
            bail!(failure)
        }
        None => print(&describe(report)),
    }
}
