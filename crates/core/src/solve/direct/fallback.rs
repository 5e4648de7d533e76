//! The reasons for taking double precision where single precision was asked for.

use std::fmt;

/// Why a factor in single precision did not do.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fallback {
    /// A pivot of the factor was not positive in single precision.
    NoFactor,
    /// Refinement with the factor came to a halt before the answer was right.
    Stalled,
}

impl fmt::Display for Fallback {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let why = match self {
            Self::NoFactor => "single precision finds no factor",
            Self::Stalled => "refinement with a single-precision factor comes to a halt",
        };
        write!(f, "{why}, so double precision was taken")
    }
}
