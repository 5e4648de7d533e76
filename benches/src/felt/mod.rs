//! Report `felt`: what a hand feels of late answers, by three ways to render them, and whether a
//! millisecond is kept.

mod rates;
mod rendered;
mod report;
mod served;

pub use report::measure;
