//! Begin and end of the export, and the values that it reads.

use crate::backend;
use crate::error::StartError;
use crate::observed::Observed;

/// The export of a program, which ends when it is dropped: what has not been exported yet is sent, for some
/// seconds at most.
#[must_use = "the export ends when it is dropped"]
pub struct Export(#[allow(dead_code, reason = "kept for its end")] backend::Exporting);

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
        Some(variable) if !is_off => {
            backend::start(program, version, variable).map(|begun| Some(Export(begun)))
        }
        _ => Ok(None),
    }
}

/// [`start`] for a program that goes on without: what is wrong is a warning in its log.
pub fn start_or_warn(program: &'static str, version: &'static str) -> Option<Export> {
    start(program, version)
        .inspect_err(|error| tracing::warn!(%error, "no traces and no metrics"))
        .unwrap_or_default()
}

/// Exports values with every export of metrics, for as long as the program runs; does nothing before
/// [`start`].
pub fn observe(values: Vec<Observed>) {
    backend::observe(values);
}
