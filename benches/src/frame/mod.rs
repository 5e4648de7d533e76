//! Report `frame`: round trip of a frame over loopback TCP against an echo of the same bytes.

mod asker;
mod report;
mod round_trips;

pub use report::measure;
