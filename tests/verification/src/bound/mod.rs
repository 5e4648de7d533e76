//! Report `bound`: random grips whose proven bound must not be below the true error.

mod attack;
mod exact;
mod grips;
mod report;
mod scenes;
mod tally;

pub use report::measure;
