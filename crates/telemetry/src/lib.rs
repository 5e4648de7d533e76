//! Traces and metrics of the programs of Softgrasp, by OpenTelemetry: where a request spent its time, from
//! the client through the server to the cluster.
//!
//! A program calls [`start()`] or [`start_or_warn`] once. It exports by OTLP over HTTP if the variables of OpenTelemetry's
//! specification name a collector (`OTEL_EXPORTER_OTLP_ENDPOINT`), and if the feature `otlp` is compiled in.
//! Else all calls of this crate do nothing.
//!
//! ```
//! use softgrasp_telemetry::RequestSpan;
//!
//! let mut span = RequestSpan::client("Ask", 7);
//! span.set("softgrasp.method", "condensed");
//! // What the request carries over the wire; nothing where no collector was named.
//! assert_eq!(span.context(), None);
//! ```

#[cfg(not(feature = "otlp"))]
mod absent;
mod attribute;
mod backend;
mod error;
mod export;
mod observed;
#[cfg(feature = "otlp")]
mod otlp;
mod request_span;

pub use attribute::AttributeValue;
pub use error::StartError;
pub use export::{Export, observe, start, start_or_warn};
pub use observed::{DURATION_BOUNDS_S, Observed};
pub use request_span::RequestSpan;
