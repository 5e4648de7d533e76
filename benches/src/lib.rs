//! Reports of Softgrasp: measured figures, each beside its error.
//!
//! How a report is made: a [`scene`] is set up and its answer known ([`reference`]); competitors
//! take turns ([`sample`]), and none's time counts before its answer was compared; [`table`] and
//! [`plot`] give it a form, and [`report`] writes it under the head that [`machine`] knows.
//! A further report is one more file, one more [`ReportName`] and one more arm of [`run`].

pub mod accuracy;
mod axis;
pub mod bound;
pub mod collision;
pub mod contact;
pub mod echo;
pub mod fit;
pub mod flicker;
pub mod frontier;
pub mod hard_cases;
pub mod large;
pub mod latency;
pub mod limits;
pub mod machine;
pub mod plot;
mod programs;
mod random;
pub mod reference;
pub mod report;
pub mod report_error;
mod requests;
pub mod sample;
pub mod scaling;
pub mod scene;
pub mod service;
pub mod stages;
pub mod table;
pub mod tail;
pub mod thesis;
pub mod threads;
mod visitors;

use std::path::PathBuf;

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
    /// Figures 5.1, 5.2 and 6.13 to 6.16 of the thesis, measured again.
    Scaling,
    /// Force of one press on finer meshes by each contact model, and its frame time.
    Contact,
    /// Every element against closed forms and published values.
    Accuracy,
    /// Tree build, refit and search against parry3d and brute force.
    Collision,
    /// Every way through hard cases, against what was promised.
    HardCases,
    /// Noise of the devices against the hysteresis of the grasp.
    Flicker,
    /// Large deformation: error against time of frames, and random walks of the hand.
    Large,
    /// Random grips: the proven bound against the true error.
    Bound,
    /// What users of one server get: in real time, beside others' long work, among many and hostile clients.
    Service,
}

impl ReportName {
    /// The name, which is also that of its files.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Latency => "latency",
            Self::Frontier => "frontier",
            Self::Limits => "limits",
            Self::Scaling => "scaling",
            Self::Contact => "contact",
            Self::Accuracy => "accuracy",
            Self::Collision => "collision",
            Self::HardCases => "hard-cases",
            Self::Bound => "bound",
            Self::Flicker => "flicker",
            Self::Large => "large",
            Self::Service => "service",
        }
    }
}

/// Measures one report and writes its files.
///
/// # Errors
/// [`ReportError`]; an answer that fails its check is one, and then nothing is written, except that
/// [`ReportError::Failed`] comes after the files.
pub fn run(name: ReportName, options: &Options) -> Result<(Report, Vec<PathBuf>), ReportError> {
    let mut report = match name {
        ReportName::Latency => latency::measure(options)?,
        ReportName::Frontier => frontier::measure(options)?,
        ReportName::Limits => limits::measure(options)?,
        ReportName::Scaling => scaling::measure(options)?,
        ReportName::Contact => contact::measure(options)?,
        ReportName::Accuracy => accuracy::measure(options)?,
        ReportName::Collision => collision::measure(options)?,
        ReportName::HardCases => hard_cases::measure(options)?,
        ReportName::Bound => bound::measure(options)?,
        ReportName::Flicker => flicker::measure(options)?,
        ReportName::Large => large::measure(options)?,
        ReportName::Service => service::measure(options)?,
    };
    report.end();
    let files = report.write(&options.out)?;
    report.check_faults()?;
    Ok((report, files))
}
