//! Instrumented glove and tracker: device bytes ⇄ samples, without I/O.

pub mod alignment;
pub mod calibration;
pub mod cyberglove;
mod detected;
pub mod fastrak;
mod feeding;
mod inbox;
mod mount;
pub mod recordings;
mod sample;

pub use detected::Detected;
pub use mount::ReceiverMount;
pub use sample::{Freshness, GloveReading, HandSample, SampleHold, TrackerReading};
