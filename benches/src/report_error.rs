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

/// Why a report cannot be made.
#[derive(Debug, thiserror::Error)]
pub enum ReportError {
    /// An object could not be generated.
    #[error(transparent)]
    Generate(#[from] GenerateError),
    /// The elements make no mesh.
    #[error(transparent)]
    Mesh(#[from] MeshError),
    /// The numbers describe no material.
    #[error(transparent)]
    Material(#[from] MaterialError),
    /// A model could not be made or held.
    #[error(transparent)]
    Model(#[from] ModelError),
    /// A method found no solution.
    #[error(transparent)]
    Solve(#[from] SolveError),
    /// The nodes and weights make no mask.
    #[error(transparent)]
    Mask(#[from] MaskError),
    /// The contacts do not hold the body, or cannot be condensed.
    #[error(transparent)]
    Condensed(#[from] CondensedError),
    /// A step of a free object in contact could not be made.
    #[error(transparent)]
    Step(#[from] StepError),
    /// The known degrees of freedom do not fit the system.
    #[error(transparent)]
    Partition(#[from] PartitionError),
    /// A factor over fronts could not be made.
    #[error(transparent)]
    Front(#[from] FrontError),
    /// No equilibrium was found.
    #[error(transparent)]
    NoEquilibrium(#[from] NoEquilibrium),
    /// A sphere tree could not be built or refitted.
    #[error(transparent)]
    Tree(#[from] TreeError),
    /// The connection between client and server failed.
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
    /// A pool of threads could not be started.
    #[error("no pool of {threads} threads: {source}")]
    Threads {
        /// Number of threads asked for.
        threads: usize,
        /// Error of the thread pool.
        source: rayon::ThreadPoolBuildError,
    },
    /// An answer failed its check, so that its time means nothing.
    #[error("{what}: error {error:e}, allowed is {allowed:e}; its time is not reported")]
    Wrong {
        /// Name of the check.
        what: String,
        /// Error of the answer.
        error: f64,
        /// Error that is allowed.
        allowed: f64,
    },
    /// A program to be measured is missing.
    #[error("there is no program {}; build all with `cargo build --release --workspace`", path.display())]
    NoProgram {
        /// Path at which it was looked for.
        path: PathBuf,
    },
    /// A process could not be started or observed.
    #[error("{what}: {source}")]
    Process {
        /// Name of the process.
        what: String,
        /// Error of the operating system.
        source: std::io::Error,
    },
    /// A process failed or hung.
    #[error("{what} failed: {}", said.trim())]
    Ended {
        /// Name of the process.
        what: String,
        /// Output of the process.
        said: String,
    },
    /// A file that a program wrote does not contain what is expected.
    #[error("{} cannot be read: {why}", path.display())]
    Unreadable {
        /// Path of the file.
        path: PathBuf,
        /// Reason why it cannot be used.
        why: String,
    },
    /// There are too few measurements to fit a law.
    #[error("{what}: {count} measurements are too few for a fit")]
    TooFew {
        /// Name of the law.
        what: String,
        /// Number of measurements.
        count: usize,
    },
    /// Some rows did not keep their limits; the files are written.
    #[error("{} of the report's rows failed:\n  {}", rows.len(), rows.join("\n  "))]
    Failed {
        /// Rows that failed, each with its reason.
        rows: Vec<String>,
    },
    /// A figure could not be drawn.
    #[error(transparent)]
    Plot(#[from] PlotError),
    /// A file could not be written.
    #[error("cannot write {}: {source}", path.display())]
    Write {
        /// Path of the file or folder.
        path: PathBuf,
        /// Error of the operating system.
        source: std::io::Error,
    },
}
