//! Verification in full, by a command: `cargo run --release --bin softgrasp-verify -- REPORT` writes every error
//! into `reports/`, in the form of `softgrasp-bench`. Nothing here is timed.
//!
//! The short form of each report runs in `cargo test` (`tests/` of this package). Machine, table, page and command
//! line are those of `softgrasp-bench`; a report is one folder here and one [`ReportName`].
//!
//! ```no_run
//! use softgrasp_bench::Options;
//! use softgrasp_verification::{ReportName, measure};
//!
//! let options = Options { is_quick: true, ..Options::default() };
//! println!("{}", measure(ReportName::Flicker, &options)?.markdown());
//! # Ok::<(), softgrasp_bench::ReportError>(())
//! ```

pub mod accuracy;
pub mod bound;
mod bricks;
pub mod flicker;
pub mod hard_cases;

use softgrasp_bench::{Options, Report, ReportError};

/// A report by its name on the command line.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum ReportName {
    /// Every element against closed forms and published values.
    Accuracy,
    /// Random grips: the proven bound against the true error.
    Bound,
    /// Every way through hard cases, against what was promised.
    HardCases,
    /// Noise of the devices against the hysteresis of the grasp.
    Flicker,
}

/// Makes one report.
///
/// # Errors
/// [`ReportError`], also for an answer that fails its check.
pub fn measure(name: ReportName, options: &Options) -> Result<Report, ReportError> {
    match name {
        ReportName::Accuracy => accuracy::measure(options),
        ReportName::Bound => bound::measure(options),
        ReportName::HardCases => hard_cases::measure(options),
        ReportName::Flicker => flicker::measure(options),
    }
}
