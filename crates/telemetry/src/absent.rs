//! What the feature `otlp` would do, without it: nothing.

use softgrasp_protocol::TraceContext;

use crate::attribute::AttributeValue;
use crate::error::StartError;
use crate::observed::Observed;

/// There is none.
pub(crate) enum Exporting {}

/// There is none.
pub(crate) enum Span {}

pub(crate) fn start(
    _: &'static str,
    _: &'static str,
    variable: &'static str,
) -> Result<Exporting, StartError> {
    Err(StartError::NotCompiled { variable })
}

pub(crate) fn observe(_: Vec<Observed>) {}

impl Span {
    pub fn client(_: &'static str, _: u64, _: Option<TraceContext>) -> Option<Self> {
        None
    }

    pub fn server(
        _: &'static str,
        _: (u64, u64),
        _: impl FnOnce() -> Option<TraceContext>,
    ) -> Option<Self> {
        None
    }

    pub fn is_recorded(&self) -> bool {
        match *self {}
    }

    pub fn context(&self) -> Option<TraceContext> {
        match *self {}
    }

    pub fn set(&mut self, _: &'static str, _: AttributeValue) {
        match *self {}
    }

    pub fn fail(&mut self, _: String, _: impl FnOnce() -> String) {
        match *self {}
    }
}
