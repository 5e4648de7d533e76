//! What the calls of this crate do: export by OTLP where that is compiled in, nothing where it is not.

#[cfg(not(feature = "otlp"))]
pub(crate) use crate::absent::{Exporting, Span, observe, start};
#[cfg(feature = "otlp")]
pub(crate) use crate::otlp::{Exporting, Span, observe, start};
