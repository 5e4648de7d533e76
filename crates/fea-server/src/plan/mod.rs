//! Plans the answer to a question: method, element and precision, within the memory there is.

mod admission;
mod frame;
mod once;
mod predicted;
mod rates;
mod shortage;
mod why;

pub(crate) use admission::PlanError;
pub(crate) use admission::{Subject, admit, counted, shortage};
pub(crate) use frame::plan_frame;
pub(crate) use once::{OnceRequest, plan_after_order, plan_once};
pub(crate) use predicted::{columns_ms, factor_ms, large_frame_ms, request_ms};
pub(crate) use rates::MeasuredRates;
pub use rates::measure_rates;
pub(crate) use why::because;
