//! The span of one request: its place in the trace, its duration, and how it ended.

use softgrasp_protocol::TraceContext;

use crate::attribute::AttributeValue;
use crate::backend::Span;

/// One request as a program sees it, from its creation until it is dropped. Its duration is exported as a
/// metric too.
#[must_use = "a span ends when it is dropped"]
pub struct RequestSpan(Option<Span>);

impl RequestSpan {
    /// A request that this program makes, named by its kind; the first span of a new trace.
    pub fn client(kind: &'static str, request_id: u64) -> Self {
        Self(Span::client(kind, request_id, None))
    }

    /// A request that this program makes while it works for another one, whose trace it belongs to.
    pub fn client_of(parent: Option<TraceContext>, kind: &'static str, request_id: u64) -> Self {
        Self(Span::client(kind, request_id, parent))
    }

    /// A request that this program answers. `session` is the number that the log's lines have too; the
    /// parent is read only if the span is recorded anywhere.
    pub fn server(
        kind: &'static str,
        (session, request_id): (u64, u64),
        parent: impl FnOnce() -> Option<TraceContext>,
    ) -> Self {
        Self(Span::server(kind, (session, request_id), parent))
    }

    /// Whether attributes of this span are kept.
    pub fn is_recorded(&self) -> bool {
        self.0.as_ref().is_some_and(Span::is_recorded)
    }

    /// What a request of this span carries over the wire.
    pub fn context(&self) -> Option<TraceContext> {
        self.0.as_ref().and_then(Span::context)
    }

    /// Sets an attribute.
    pub fn set(&mut self, name: &'static str, value: impl Into<AttributeValue>) {
        if let Some(span) = self.0.as_mut().filter(|span| span.is_recorded()) {
            span.set(name, value.into());
        }
    }

    /// Marks the request as failed: `code` is one of a few words, which the metric tells too; the sentence is
    /// for people.
    pub fn fail(&mut self, code: impl Into<String>, sentence: impl FnOnce() -> String) {
        if let Some(span) = &mut self.0 {
            span.fail(code.into(), sentence);
        }
    }
}
