//! Finds the figures that a document quotes from reports in the reports again.
//!
//! A paragraph, bullet or table row names where its figures come from in a comment that is not
//! shown: `<!-- latency-frame.csv | contact = mask | nodes = 10648 | -> p50_ms, error_rel -->`: the file,
//! what selects its rows, and the columns that are quoted. Several alternatives of a value are
//! divided by `/`. A column without a unit in its name may be given one: `figure_1998 [s]`. The
//! report must be linked, and must link the file. [`faults`] says what does not agree.

mod check;
mod figure;
mod item;
mod source;
mod unit;

pub use check::{Reports, faults, item_faults};
pub use figure::{Figure, figures};
pub use item::{Item, items};
