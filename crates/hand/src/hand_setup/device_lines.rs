//! How the lines to glove and tracker are set up, as plain numbers and choices.

use serde::{Deserialize, Serialize};

use crate::devices::fastrak::Station;

/// Speeds of a glove's interface unit, bits per second.
pub const GLOVE_BAUDS: [u32; 10] =
    [300, 600, 1200, 2400, 4800, 9600, 19_200, 38_400, 57_600, 115_200];
/// Speeds of a tracker, bits per second.
pub const TRACKER_BAUDS: [u32; 9] = [300, 1200, 2400, 4800, 9600, 19_200, 38_400, 57_600, 115_200];

/// How the glove is asked for its readings.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum GloveMode {
    /// One request for each reading: cannot fall out of step.
    #[default]
    Polled,
    /// The glove sends by itself.
    Streamed,
}

impl GloveMode {
    /// Word of the mode in the configuration file.
    pub(super) const fn word(self) -> &'static str {
        match self {
            Self::Polled => "polled",
            Self::Streamed => "streamed",
        }
    }
}

/// Settings of the serial line to the glove.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct GloveLine {
    /// Bits per second, one of [`GLOVE_BAUDS`].
    pub baud: u32,
    /// How the glove is asked for its readings.
    pub mode: GloveMode,
}

impl Default for GloveLine {
    /// The speed of the later interface units, polled.
    fn default() -> Self {
        Self { baud: 115_200, mode: GloveMode::default() }
    }
}

/// The side of the transmitter on which the hand is: the tracker cannot tell a place from its
/// opposite.
///
/// Frame: transmitter, X forward, Y right, Z down.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Hemisphere {
    /// Before the transmitter, toward +X.
    #[default]
    Forward,
    /// Behind the transmitter, toward −X.
    Back,
    /// To the right of the transmitter, toward +Y.
    Right,
    /// To the left of the transmitter, toward −Y.
    Left,
    /// Below the transmitter, toward +Z.
    Lower,
    /// Above the transmitter, toward −Z.
    Upper,
}

impl Hemisphere {
    /// The direction for the tracker's command `H`.
    pub const fn direction(self) -> [f64; 3] {
        match self {
            Self::Forward => [1.0, 0.0, 0.0],
            Self::Back => [-1.0, 0.0, 0.0],
            Self::Right => [0.0, 1.0, 0.0],
            Self::Left => [0.0, -1.0, 0.0],
            Self::Lower => [0.0, 0.0, 1.0],
            Self::Upper => [0.0, 0.0, -1.0],
        }
    }

    /// Word of the hemisphere in the configuration file.
    pub(super) const fn word(self) -> &'static str {
        match self {
            Self::Forward => "forward",
            Self::Back => "back",
            Self::Right => "right",
            Self::Left => "left",
            Self::Lower => "lower",
            Self::Upper => "upper",
        }
    }
}

/// Settings of the serial line to the tracker.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TrackerLine {
    /// Bits per second, one of [`TRACKER_BAUDS`].
    pub baud: u32,
    /// Station number: socket of the receiver.
    pub station: Station,
    /// Side of the transmitter on which the hand is.
    pub hemisphere: Hemisphere,
}

impl Default for TrackerLine {
    fn default() -> Self {
        Self { baud: 115_200, station: Station::FIRST, hemisphere: Hemisphere::default() }
    }
}
