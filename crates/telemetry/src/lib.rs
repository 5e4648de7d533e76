//! Traces and metrics of the programs of Softgrasp, by OpenTelemetry: where a request spent its time, from
//! the client through the server to the cluster.
//!
//! A program calls [`start`] once. It exports by OTLP over HTTP if the variables of OpenTelemetry's
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

mod attribute;
mod observed;
mod request_span;
mod start;

#[cfg(feature = "otlp")]
#[path = "otlp/mod.rs"]
mod backend;
#[cfg(not(feature = "otlp"))]
#[path = "absent.rs"]
mod backend;

pub use attribute::AttributeValue;
pub use observed::{Observed, observe};
pub use request_span::RequestSpan;
pub use start::{Export, StartError, start};
