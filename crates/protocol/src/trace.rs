//! Trace of a request: which span of the client's program a server's span belongs under.

use wincode::{SchemaRead, SchemaWrite};

/// Trace and span that a request belongs to, so that what several programs tell of it is one trace.
///
/// Source: W3C, "Trace Context" (the fields of `traceparent`).
#[derive(Clone, Copy, Debug, PartialEq, Eq, SchemaRead, SchemaWrite)]
pub struct TraceContext {
    /// Identity of the trace; not all zero.
    pub trace_id: [u8; 16],
    /// Identity of the span that the request was made in; not all zero.
    pub span_id: [u8; 8],
    /// Whether the trace is recorded.
    pub is_sampled: bool,
}

/// Field behind those of a part, left out where a request belongs to no trace.
#[derive(Clone, Debug, Default, SchemaRead, SchemaWrite)]
pub(crate) struct TracePart {
    pub(crate) trace: Option<TraceContext>,
}

impl TraceContext {
    /// Whether trace and span have an identity.
    pub fn is_valid(&self) -> bool {
        self.trace_id != [0; 16] && self.span_id != [0; 8]
    }
}
