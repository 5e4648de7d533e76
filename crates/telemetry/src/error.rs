//! Errors of the export.

/// Why nothing can be exported.
#[derive(Debug, thiserror::Error)]
pub enum StartError {
    /// The variables name a collector, and this program was compiled without the feature.
    #[error("{variable} is set, but this program was built without the feature otlp")]
    NotCompiled {
        /// Variable of the environment.
        variable: &'static str,
    },
    /// The variables cannot be used.
    #[error("traces and metrics cannot be exported: {reason}")]
    Settings {
        /// What is wrong, with the name of the variable.
        reason: String,
    },
}
