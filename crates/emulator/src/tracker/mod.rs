//! The emulated tracker: commands, settings, records and replies.

mod command;
mod device;
mod record;
mod settings;

pub use device::{EmulatedTracker, EmulatedTrackerKind};
