//! Why a text is not the configuration of a hand.

use softgrasp_grasp::hand::DimensionsError;

use crate::devices::calibration::CalibrationError;

/// Why a text is not the configuration of a hand.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum HandFileError {
    /// The text is not TOML, has an unknown key, or a value of another kind; with line and key.
    #[error("not the configuration of a hand: {0}")]
    Syntax(String),
    /// The file has a format number that this program does not read.
    #[error("format {found}, this program reads {reads}")]
    Format {
        /// Format number of the file.
        found: u32,
        /// Format number that this program reads.
        reads: u32,
    },
    /// No hand has this size.
    #[error("hand: {0}")]
    Size(#[from] DimensionsError),
    /// A value is impossible.
    #[error("{key} is {value}; it must be {expected}")]
    Value {
        /// Table and key of the value.
        key: &'static str,
        /// Value that stands in the file.
        value: String,
        /// What the value must be.
        expected: &'static str,
    },
    /// A rotation is given twice or not at all.
    #[error("[{table}] needs one of quaternion_wxyz and rotation_vector_deg, it has {found}")]
    Rotation {
        /// Name of the table that holds the pose.
        table: &'static str,
        /// Number of rotations in the table.
        found: usize,
    },
    /// The calibration cannot be read.
    #[error("calibration: {0}")]
    Calibration(#[from] CalibrationError),
    /// The calibration is for the other hand.
    #[error("the calibration is for a {calibration} hand, the configuration for a {hand} one")]
    OtherHand {
        /// Hand of the calibration: right or left.
        calibration: &'static str,
        /// Hand of the configuration: right or left.
        hand: &'static str,
    },
}

impl HandFileError {
    /// The error about a value that is impossible.
    pub(super) fn value(
        key: &'static str,
        value: impl std::fmt::Debug,
        expected: &'static str,
    ) -> Self {
        Self::Value { key, value: format!("{value:?}"), expected }
    }
}
