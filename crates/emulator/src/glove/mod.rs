//! The emulated glove: commands, state of the interface unit, records and replies.

mod command;
mod device;
mod unit;

pub use device::{EmulatedGlove, EmulatedGloveKind};
