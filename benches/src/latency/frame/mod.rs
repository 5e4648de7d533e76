//! Warm frames: round trip over loopback TCP against an echo of the same bytes.

mod asker;
mod report;
mod round_trips;

pub(super) use report::measure;
