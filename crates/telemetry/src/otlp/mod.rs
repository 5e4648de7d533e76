//! Export by OTLP over HTTP: the providers of a program, its spans and its metrics.

mod collector;
mod provider;
mod span;

pub(crate) use provider::{Exporting, observe, start};
pub(crate) use span::Span;
