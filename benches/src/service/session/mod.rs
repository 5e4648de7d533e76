//! Results for a user of `run` in real time, from runs of the real programs.

mod large;
mod live;
mod record;
mod report;
mod way;

pub(super) use report::measure;
