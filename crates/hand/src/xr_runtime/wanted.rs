//! Which hands of a runtime are asked for.

use std::fmt;
use std::str::FromStr;

use softgrasp_grasp::hand::Handedness;

use super::error::RuntimeError;

/// Hands that are asked for.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum WantedHands {
    /// The left and the right hand.
    #[default]
    Both,
    /// One hand.
    One(Handedness),
}

impl WantedHands {
    /// Sides of the hands.
    pub const fn sides(self) -> &'static [Handedness] {
        match self {
            Self::Both => &[Handedness::Left, Handedness::Right],
            Self::One(Handedness::Left) => &[Handedness::Left],
            Self::One(Handedness::Right) => &[Handedness::Right],
        }
    }
}

impl FromStr for WantedHands {
    type Err = RuntimeError;

    fn from_str(name: &str) -> Result<Self, RuntimeError> {
        match name {
            "" => Ok(Self::Both),
            "left" => Ok(Self::One(Handedness::Left)),
            "right" => Ok(Self::One(Handedness::Right)),
            _ => Err(RuntimeError::NoSuchHand { name: name.to_owned() }),
        }
    }
}

impl fmt::Display for WantedHands {
    /// The word of the command line: `openxr`, `openxr:left`, `openxr:right`.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Both => f.write_str("openxr"),
            Self::One(side) => write!(f, "openxr:{}", side.name()),
        }
    }
}
