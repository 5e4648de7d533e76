//! The configuration of a hand, its glove and its tracker, and the file that holds it.

mod configuration;
mod device_lines;
mod error;
mod pose_text;
mod reading;
mod setup;

pub use configuration::HandConfiguration;
pub use device_lines::{GLOVE_BAUDS, GloveLine, GloveMode, Hemisphere, TRACKER_BAUDS, TrackerLine};
pub use error::HandFileError;
pub use setup::HandSetup;
