//! What the trace of a request tells: its kind, session and model, and of the answer how it was found.

use softgrasp_protocol::{Answer, Frame, Kind, ModelHash, Reply, Request};
use softgrasp_telemetry::RequestSpan;

use crate::log_line::foreign_sentence;
use crate::refusal::Refusal;

/// Span of a request that has come; the part of the client's trace that is this server's.
pub(crate) fn begin(frame: &Frame, kept_model: Option<ModelHash>, session: u64) -> RequestSpan {
    let kind = match frame.kind() {
        // As on the page `/metrics`.
        Some(Kind::Ask) if kept_model.is_some() => "Frame",
        Some(kind) => kind.name(),
        None => "unknown",
    };
    let mut span =
        RequestSpan::server(kind, (session, frame.request_id()), || Request::trace(frame));
    if let (Some(model), true) = (kept_model, span.is_recorded()) {
        span.set("softgrasp.model", model.to_string());
    }
    span
}

/// Tells how a request was answered, or why it was refused.
pub(crate) fn tell(span: &mut RequestSpan, replied: &Result<Option<Reply>, Refusal>) {
    match replied {
        Err(refusal) => span.fail(refusal.code().to_string(), || foreign_sentence(refusal)),
        Ok(Some(reply)) if span.is_recorded() => tell_reply(span, reply),
        Ok(_) => {}
    }
}

fn tell_reply(span: &mut RequestSpan, reply: &Reply) {
    match reply {
        Reply::Answer(answer) => tell_answer(span, answer),
        Reply::ContactAnswer(answered) => {
            tell_answer(span, &answered.answer);
            let contact = &answered.contact;
            span.set("softgrasp.contact.points", answered.points.len() as u64);
            span.set("softgrasp.contact.rounds", u64::from(contact.rounds));
            span.set("softgrasp.contact.is_converged", contact.is_converged);
            span.set("softgrasp.contact.residual_rel", contact.residual_rel);
        }
        Reply::ModelReady(ready) => {
            span.set("softgrasp.model", ready.model.to_string());
            span.set("softgrasp.unknown_dofs", ready.unknown_dofs);
            span.set("softgrasp.reused", ready.reused);
        }
        _ => {}
    }
}

/// The numbers of the report; an answer without one (`report: none`) has no method.
fn tell_answer(span: &mut RequestSpan, answer: &Answer) {
    let report = &answer.report;
    if report.method.is_empty() {
        return;
    }
    span.set("softgrasp.method", report.method.as_str());
    span.set("softgrasp.unknown_dofs", report.unknown_dofs);
    span.set("softgrasp.factor_reused", report.factor_reused);
    let stages = report.stage_ms;
    for (name, ms) in [
        ("softgrasp.decode_ms", stages.decode),
        ("softgrasp.queue_ms", stages.queue),
        ("softgrasp.assemble_ms", stages.assemble),
        ("softgrasp.order_ms", stages.order),
        ("softgrasp.factor_ms", stages.factor),
        ("softgrasp.solve_ms", stages.solve),
        ("softgrasp.encode_ms", stages.encode),
    ] {
        span.set(name, ms);
    }
    if let Some(bound) = report.error_bound_rel {
        span.set("softgrasp.error_bound_rel", bound);
    }
    if let Some(large) = &answer.large {
        span.set("softgrasp.is_large", !large.is_linear);
        span.set("softgrasp.newton_steps", u64::from(large.newton_steps));
    }
}
