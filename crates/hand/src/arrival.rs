//! Bytes as they came from a device, and when.

use serde::{Deserialize, Serialize};

/// Where bytes come from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Device {
    /// The instrumented glove.
    Glove,
    /// The tracker of the wrist.
    Tracker,
    /// A stream of joint poses.
    Joints,
}

impl Device {
    /// Its name in sentences.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Glove => "glove",
            Self::Tracker => "tracker",
            Self::Joints => "sender of joints",
        }
    }
}

/// Bytes that came together.
#[derive(Clone, Debug, PartialEq)]
pub struct Arrival {
    /// Where they come from.
    pub device: Device,
    /// When their first byte came, s on the client's clock; `None` stands for the tick that takes
    /// them: a hand that is played sends when it is looked at.
    pub at_s: Option<f64>,
    /// They are a datagram: what follows does not go on where they end.
    pub is_datagram: bool,
    /// The bytes.
    pub bytes: Vec<u8>,
}

impl Arrival {
    /// Bytes of a stream that come with the tick.
    pub fn with_tick(device: Device, bytes: Vec<u8>) -> Self {
        Self { device, at_s: None, is_datagram: false, bytes }
    }
}
