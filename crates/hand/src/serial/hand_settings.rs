//! Settings of serial devices as a hand's configuration has them.

use super::settings::{GloveMode, GloveSettings, SerialSettings, TrackerSettings};
use super::source::SerialSource;
use crate::hand_setup::{GloveMode as Asked, HandConfiguration};

/// Readings per second of a glove, polled or streamed.
const GLOVE_HZ: f64 = 100.0;

/// The devices on these ports, set up as the configuration says; the speed of a line is the
/// port's.
pub fn settings_of_hand(
    source: &SerialSource,
    configuration: &HandConfiguration,
) -> SerialSettings {
    let HandConfiguration { setup, glove, tracker, .. } = configuration;
    let mode = match glove.mode {
        Asked::Polled => GloveMode::Polled { hz: GLOVE_HZ },
        Asked::Streamed => GloveMode::Streamed { hz: GLOVE_HZ },
    };
    let glove = source.glove.clone().map(|port| GloveSettings {
        mode,
        options: setup.glove_options,
        ..GloveSettings::new(port)
    });
    let tracker = source.tracker.clone().map(|port| TrackerSettings {
        station: tracker.station,
        format: setup.tracker,
        hemisphere: tracker.hemisphere.direction(),
        ..TrackerSettings::new(port)
    });
    SerialSettings { glove, tracker }
}
