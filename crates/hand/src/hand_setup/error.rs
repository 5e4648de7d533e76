//! Why a text is not the configuration of a hand.

use softgrasp_grasp::hand::DimensionsError;

use crate::devices::calibration::CalibrationError;

/// Why a text is not the configuration of a hand.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum HandFileError {
    /// Not TOML, an unknown key, or a value of another kind; with line and key.
    #[error("not the configuration of a hand: {0}")]
    Syntax(String),
    /// Written by another version.
    #[error("format {found}, this program reads {reads}")]
    Format {
        /// The file's format.
        found: u32,
        /// The format of this program.
        reads: u32,
    },
    /// No hand has this size.
    #[error("hand: {0}")]
    Size(#[from] DimensionsError),
    /// A value that cannot be.
    #[error("{key} is {value}; it must be {expected}")]
    Value {
        /// Table and key.
        key: &'static str,
        /// The value.
        value: String,
        /// What it must be.
        expected: &'static str,
    },
    /// A rotation is given twice or not at all.
    #[error("[{table}] needs one of quaternion_wxyz and rotation_vector_deg, it has {found}")]
    Rotation {
        /// Which table.
        table: &'static str,
        /// How many of them.
        found: usize,
    },
    /// The calibration cannot be read.
    #[error("calibration: {0}")]
    Calibration(#[from] CalibrationError),
    /// The calibration is for the other hand.
    #[error("the calibration is for a {calibration} hand, the configuration for a {hand} one")]
    OtherHand {
        /// The calibration's.
        calibration: &'static str,
        /// The configuration's.
        hand: &'static str,
    },
}

impl HandFileError {
    /// A value that cannot be.
    pub(super) fn value(
        key: &'static str,
        value: impl std::fmt::Debug,
        expected: &'static str,
    ) -> Self {
        Self::Value { key, value: format!("{value:?}"), expected }
    }
}
