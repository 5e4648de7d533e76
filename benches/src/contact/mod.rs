//! Report `contact`: what a fingertip's contact model costs, and whether its force converges.

mod half_space;
mod report;
mod steps;
mod tips;
mod verify;

pub use report::measure;
pub(crate) use tips::{Tips, WANT_ALL};
pub(crate) use verify::verify;
