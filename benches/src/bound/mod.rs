//! Report `bound`: random grips, and whether the proven bound is ever below the true error.

mod attack;
mod exact;
mod grips;
mod report;
mod scenes;
mod tally;

pub use report::measure;
