//! Reports of Softgrasp: measured figures, each beside its error.
//!
//! How a report is made: a [`scene`] is set up and its answer known ([`reference`]); competitors
//! take turns ([`sample`]), and none's time counts before its answer was compared; [`table`] and
//! [`plot`] give it a form, and [`report`] writes it under the head that [`machine`] knows.
//! A further report is one more file, one more [`ReportName`] and one more arm of [`measure`].
//! What times nothing is verification and stands in `tests/verification`, in the same form.
//!
//! ```
//! use softgrasp_bench::Report;
//! use softgrasp_bench::table::Table;
//!
//! let mut report = Report::begin("example", "An example", "1", &Default::default());
//! let mut table = Table::new("example", "One row", &["nodes"]);
//! table.push([267usize.into()]);
//! report.table(table);
//! assert!(report.markdown().contains("| 267 |"));
//! ```

pub mod axis;
mod balance;
mod ball;
pub mod collision;
pub mod command;
pub mod contact;
pub mod echo;
pub mod felt;
pub mod fit;
pub mod frontier;
pub mod large;
pub mod latency;
pub mod limits;
pub mod machine;
pub mod plot;
mod programs;
pub mod quick;
pub mod random;
pub mod reference;
pub mod report;
pub mod report_error;
mod requests;
pub mod sample;
pub mod scale;
pub mod scaling;
pub mod scene;
pub mod service;
pub mod stages;
pub mod table;
pub mod tail;
pub mod thesis;
pub mod threads;
mod visitors;

pub use report::{Options, Report, ReportError};

/// A report by its name on the command line.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum ReportName {
    /// Warm frames against an echo, the first frame of a grip, a request every millisecond.
    Latency,
    /// Time against error of every method, precision and element.
    Frontier,
    /// The factor over fronts against what the machine can do at most.
    Limits,
    /// Nodes against time and memory, 10⁴ to 10⁶, by factors, multigrid and a cluster's worker.
    Scale,
    /// Figures 5.1, 5.2 and 6.13 to 6.16 of the thesis, measured again.
    Scaling,
    /// Force of one press on finer meshes by each contact model, and its frame time.
    Contact,
    /// Energy and error of forces that a hand feels of late answers, and their rate.
    Felt,
    /// Tree build, refit and search against parry3d and brute force.
    Collision,
    /// Large deformation: error against time of frames, and random walks of the hand.
    Large,
    /// What users of one server get: in real time, beside others' long work, among many and hostile clients.
    Service,
}

/// Measures one report.
///
/// # Errors
/// [`ReportError`], also for an answer that fails its check.
pub fn measure(name: ReportName, options: &Options) -> Result<Report, ReportError> {
    match name {
        ReportName::Latency => latency::measure(options),
        ReportName::Frontier => frontier::measure(options),
        ReportName::Limits => limits::measure(options),
        ReportName::Scale => scale::measure(options),
        ReportName::Scaling => scaling::measure(options),
        ReportName::Contact => contact::measure(options),
        ReportName::Felt => felt::measure(options),
        ReportName::Collision => collision::measure(options),
        ReportName::Large => large::measure(options),
        ReportName::Service => service::measure(options),
    }
}
