//! Instrumented glove and tracker: device bytes ⇄ samples, without I/O.

pub mod alignment;
pub mod calibration;
pub mod cyberglove;
mod detected;
pub mod fastrak;
mod heard;
mod inbox;
mod mount;
mod pose_gate;
pub mod recordings;
mod sample;
mod sensor_gate;

pub use detected::Detected;
pub use heard::Heard;
pub use mount::ReceiverMount;
pub use pose_gate::PoseGate;
pub use sample::{Freshness, GloveReading, HandSample, SampleHold, TrackerReading};
pub use sensor_gate::SensorGate;
