//! The devices' side: an emulated glove and tracker, byte for byte, for whoever has none.
//!
//! [`EmulatedGlove`] and [`EmulatedTracker`] obey every command of theirs and send the records that
//! the devices would send, without I/O and without a clock, with faults on demand ([`Fault`]). On Unix
//! `emulation` puts them behind pseudo-terminals, which a client opens as it opens a serial port.
//! The drivers of `softgrasp-hand` are tested against them, and `glove-client emulate` starts them.
//!
//! ```
//! use softgrasp_emulator::{EmulatedGlove, EmulatedGloveKind};
//! use softgrasp_hand::devices::cyberglove::{RawSensors, SensorCount};
//!
//! let mut glove = EmulatedGlove::new(EmulatedGloveKind::default());
//! // One record is asked for, and is there a moment later.
//! glove.receive(b"G", 0.0);
//! let record = glove.send(0.5, |_| RawSensors::from_fn(SensorCount::TwentyTwo, |_| 100));
//! assert_eq!(record.first(), Some(&b'G'));
//! ```

mod chance;
#[cfg(unix)]
pub mod emulation;
mod fault;
mod glove;
mod line;
#[cfg(test)]
mod random_bytes_tests;
mod tracker;

pub use fault::{Fault, FaultSetting, UnknownFault};
pub use glove::{EmulatedGlove, EmulatedGloveKind};
pub use tracker::{EmulatedTracker, EmulatedTrackerKind};
