//! Time from sending the first question of a new grip to its answer.

mod grips;
mod report;
mod trial;

pub(super) use report::measure;
