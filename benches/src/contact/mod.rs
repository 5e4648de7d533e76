//! Report `contact`: what a fingertip's contact model costs, and whether its force converges.

mod half_space;
mod report;
mod tips;

pub use report::measure;
