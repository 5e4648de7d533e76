//! A span of a request, and the metric of its duration.

use std::borrow::Cow;
use std::time::Instant;

use opentelemetry::metrics::Histogram;
use opentelemetry::trace::{
    Span as _, SpanContext, SpanId, SpanKind, Status, TraceContextExt as _, TraceFlags, TraceId,
    TraceState, Tracer as _,
};
use opentelemetry::{Context, KeyValue, Value};
use opentelemetry_sdk::trace::Span as SdkSpan;
use softgrasp_protocol::TraceContext;

use super::provider::instruments;
use crate::attribute::AttributeValue;

/// A request under way.
pub(crate) struct Span {
    span: SdkSpan,
    began: Instant,
    durations: &'static Histogram<f64>,
    kind: &'static str,
    /// Why it failed, in one word.
    failed: Option<String>,
}

/// Name of the attribute that tells the kind of a request.
const METHOD: &str = "rpc.method";
/// Name of the attribute that tells why a request failed.
const ERROR: &str = "error.type";

impl Span {
    /// A request of this program; `None` where nothing is exported.
    pub fn client(
        kind: &'static str,
        request_id: u64,
        parent: Option<TraceContext>,
    ) -> Option<Self> {
        let instruments = instruments()?;
        let attributes = attributes(kind, request_id);
        let span = instruments
            .tracer
            .span_builder(kind)
            .with_kind(SpanKind::Client)
            .with_attributes(attributes)
            .start_with_context(&instruments.tracer, &context_of(parent));
        Some(Self::begun(span, &instruments.client_s, kind))
    }

    /// A request that this program answers; `None` where nothing is exported.
    pub fn server(
        kind: &'static str,
        (session, request_id): (u64, u64),
        parent: impl FnOnce() -> Option<TraceContext>,
    ) -> Option<Self> {
        let instruments = instruments()?;
        let mut attributes = attributes(kind, request_id);
        let session = AttributeValue::from(session);
        attributes.push(KeyValue::new("softgrasp.session", value_of(session)));
        let span = instruments
            .tracer
            .span_builder(kind)
            .with_kind(SpanKind::Server)
            .with_attributes(attributes)
            .start_with_context(&instruments.tracer, &context_of(parent()));
        Some(Self::begun(span, &instruments.server_s, kind))
    }

    fn begun(span: SdkSpan, durations: &'static Histogram<f64>, kind: &'static str) -> Self {
        Self { span, began: Instant::now(), durations, kind, failed: None }
    }

    pub fn is_recorded(&self) -> bool {
        self.span.is_recording()
    }

    pub fn context(&self) -> Option<TraceContext> {
        let context = self.span.span_context();
        context.is_valid().then(|| TraceContext {
            trace_id: context.trace_id().to_bytes(),
            span_id: context.span_id().to_bytes(),
            is_sampled: context.is_sampled(),
        })
    }

    pub fn set(&mut self, name: &'static str, value: AttributeValue) {
        self.span.set_attribute(KeyValue::new(name, value_of(value)));
    }

    pub fn fail(&mut self, code: String, sentence: impl FnOnce() -> String) {
        if self.is_recorded() {
            self.span.set_attribute(KeyValue::new(ERROR, code.clone()));
            self.span.set_status(Status::Error { description: Cow::Owned(sentence()) });
        }
        self.failed = Some(code);
    }
}

impl Drop for Span {
    fn drop(&mut self) {
        let seconds = self.began.elapsed().as_secs_f64();
        let kind = KeyValue::new(METHOD, self.kind);
        match self.failed.take() {
            None => self.durations.record(seconds, &[kind]),
            Some(code) => self.durations.record(seconds, &[kind, KeyValue::new(ERROR, code)]),
        }
        self.span.end();
    }
}

fn attributes(kind: &'static str, request_id: u64) -> Vec<KeyValue> {
    let request_id = AttributeValue::from(request_id);
    vec![
        KeyValue::new("rpc.system", "softgrasp"),
        KeyValue::new(METHOD, kind),
        KeyValue::new("softgrasp.request", value_of(request_id)),
    ]
}

/// Context whose span is the parent of a new one; without a parent a new trace begins.
fn context_of(parent: Option<TraceContext>) -> Context {
    let Some(parent) = parent else { return Context::new() };
    let flags = if parent.is_sampled { TraceFlags::SAMPLED } else { TraceFlags::default() };
    Context::new().with_remote_span_context(SpanContext::new(
        TraceId::from_bytes(parent.trace_id),
        SpanId::from_bytes(parent.span_id),
        flags,
        true,
        TraceState::default(),
    ))
}

fn value_of(value: AttributeValue) -> Value {
    match value {
        AttributeValue::Text(text) => text.into(),
        AttributeValue::Integer(count) => count.into(),
        AttributeValue::Number(number) => number.into(),
        AttributeValue::Flag(flag) => flag.into(),
    }
}
