//! Begin and end of the export.

use crate::backend;

/// The export of a program, which ends when it is dropped: what has not been exported yet is sent, for some
/// seconds at most.
#[must_use = "the export ends when it is dropped"]
pub struct Export(#[allow(dead_code, reason = "kept for its end")] pub(crate) backend::Exporting);

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

/// Variables that name a collector (OpenTelemetry specification, "OpenTelemetry Protocol Exporter").
const ENDPOINTS: [&str; 3] = [
    "OTEL_EXPORTER_OTLP_ENDPOINT",
    "OTEL_EXPORTER_OTLP_TRACES_ENDPOINT",
    "OTEL_EXPORTER_OTLP_METRICS_ENDPOINT",
];

/// Starts the export of a program if the environment names a collector; `None` if it does not, or if
/// `OTEL_SDK_DISABLED` is true.
///
/// # Errors
/// [`StartError`]; the program can go on without.
pub fn start(program: &'static str, version: &'static str) -> Result<Option<Export>, StartError> {
    let value = |name: &str| std::env::var(name).ok().filter(|text| !text.is_empty());
    let is_off = value("OTEL_SDK_DISABLED").is_some_and(|text| text.eq_ignore_ascii_case("true"));
    match ENDPOINTS.into_iter().find(|name| value(name).is_some()) {
        Some(variable) if !is_off => backend::start(program, version, variable).map(Some),
        _ => Ok(None),
    }
}
