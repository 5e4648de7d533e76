//! Emulators of glove and tracker: what the devices would send, byte for byte, without I/O and
//! without a clock.

mod chance;
mod fault;
mod glove;
mod line;
#[cfg(test)]
mod random_bytes_tests;
mod tracker;

pub use fault::{Fault, FaultSetting, UnknownFault};
pub use glove::{EmulatedGlove, EmulatedGloveKind};
pub use tracker::{EmulatedTracker, EmulatedTrackerKind};
