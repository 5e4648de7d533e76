//! Errors of making a report.

use std::path::PathBuf;

use glove_client::ask::connection::LinkError;
use softgrasp_core::contact::MaskError;
use softgrasp_core::dynamics::StepError;
use softgrasp_core::fem::MaterialError;
use softgrasp_core::mesh::{GenerateError, MeshError};
use softgrasp_core::model::ModelError;
use softgrasp_core::solve::condensed::CondensedError;
use softgrasp_core::solve::equilibrium::NoEquilibrium;
use softgrasp_core::solve::{FrontError, PartitionError, SolveError};
use softgrasp_grasp::sphere_tree::TreeError;

use crate::plot::PlotError;

/// Why there is no report.
#[derive(Debug, thiserror::Error)]
pub enum ReportError {
    /// An object could not be made.
    #[error(transparent)]
    Generate(#[from] GenerateError),
    /// Elements that make no mesh.
    #[error(transparent)]
    Mesh(#[from] MeshError),
    /// A material that is none.
    #[error(transparent)]
    Material(#[from] MaterialError),
    /// A model could not be made or held.
    #[error(transparent)]
    Model(#[from] ModelError),
    /// A method failed.
    #[error(transparent)]
    Solve(#[from] SolveError),
    /// Nodes and weights that make no mask.
    #[error(transparent)]
    Mask(#[from] MaskError),
    /// Contacts that do not hold.
    #[error(transparent)]
    Condensed(#[from] CondensedError),
    /// A step of a free object in contact could not be made.
    #[error(transparent)]
    Step(#[from] StepError),
    /// Known degrees of freedom that do not fit.
    #[error(transparent)]
    Partition(#[from] PartitionError),
    /// A factor.
    #[error(transparent)]
    Front(#[from] FrontError),
    /// An equilibrium that was not found.
    #[error(transparent)]
    NoEquilibrium(#[from] NoEquilibrium),
    /// A sphere tree could not be built or refitted.
    #[error(transparent)]
    Tree(#[from] TreeError),
    /// Client and server did not come together.
    #[error(transparent)]
    Link(#[from] LinkError),
    /// The echo that frames are compared with failed.
    #[error("the echo over loopback failed: {0}")]
    Echo(std::io::Error),
    /// The factor that times are set beside could not be made.
    #[error(
        "the stiffness of the held object could not be factored, so there is no sparse solve to compare with"
    )]
    NoFactor,
    /// A hand could not be followed.
    #[error("{0:#}")]
    Hand(anyhow::Error),
    /// No threads.
    #[error("no pool of {threads} threads: {source}")]
    Threads {
        /// Threads asked for.
        threads: usize,
        /// The system's reason.
        source: rayon::ThreadPoolBuildError,
    },
    /// An answer failed its check, so its time means nothing.
    #[error("{what}: error {error:e}, allowed is {allowed:e}; its time is not reported")]
    Wrong {
        /// What was checked.
        what: String,
        /// Its error.
        error: f64,
        /// What is allowed.
        allowed: f64,
    },
    /// A program that is measured is not there.
    #[error("there is no program {}; build all with `cargo build --release --workspace`", path.display())]
    NoProgram {
        /// Where it was looked for.
        path: PathBuf,
    },
    /// The system did not start or show a process.
    #[error("{what}: {source}")]
    Process {
        /// The process.
        what: String,
        /// The system's reason.
        source: std::io::Error,
    },
    /// A process failed or hung.
    #[error("{what} failed: {}", said.trim())]
    Ended {
        /// The process.
        what: String,
        /// What it said.
        said: String,
    },
    /// A file that a program wrote does not hold what is looked for.
    #[error("{} cannot be read: {why}", path.display())]
    Unreadable {
        /// The file.
        path: PathBuf,
        /// Why.
        why: String,
    },
    /// Nothing to fit a law to.
    #[error("{what}: {count} measurements are too few for a fit")]
    TooFew {
        /// What was to be fitted.
        what: String,
        /// Measurements there are.
        count: usize,
    },
    /// Rows that did not keep what was promised; the files are written.
    #[error("{} of the report's rows failed:\n  {}", rows.len(), rows.join("\n  "))]
    Failed {
        /// What failed, and how.
        rows: Vec<String>,
    },
    /// A figure could not be drawn.
    #[error(transparent)]
    Plot(#[from] PlotError),
    /// A file could not be written.
    #[error("cannot write {}: {source}", path.display())]
    Write {
        /// The file or folder.
        path: PathBuf,
        /// The system's reason.
        source: std::io::Error,
    },
}
