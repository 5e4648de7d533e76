//! Reads a calibration in any of the known forms.

use super::checks::CalibrationError;
use super::file::read_toml;
use super::joint_xml::read_joint_xml;
use super::linear::Calibration;
use super::point_list::{is_point_line, read_point_list};
use super::slope_matrix::read_slope_matrix;
use super::virtual_hand_reading::{TABLE_TITLE, read_virtual_hand};

/// Form in which a calibration is written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Form {
    /// This program's TOML.
    Toml,
    /// The vendor's VirtualHand `.cal`.
    VirtualHand,
    /// One line a joint: pairs of angle in rad and reading (the ASR library's `.cal`).
    PointList,
    /// XML: per joint pairs of relative reading and angle in degrees (Shadow's driver).
    JointXml,
    /// A matrix of slopes and a row of constants (GraspIt).
    SlopeMatrix,
}

impl std::fmt::Display for Form {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::Toml => "TOML",
            Self::VirtualHand => "VirtualHand",
            Self::PointList => "list of points",
            Self::JointXml => "XML list of joints",
            Self::SlopeMatrix => "matrix of slopes",
        })
    }
}

impl Form {
    /// The form a text seems to be in, by its first lines; `None` if it looks like none of them.
    fn of(text: &str) -> Option<Self> {
        let mut lines =
            text.lines().map(str::trim).filter(|l| !l.is_empty() && !l.starts_with('!'));
        let first = lines.next()?;
        let words: Vec<&str> = first.split_whitespace().take(3).collect();
        let is_shape =
            words.len() == 2 && words.iter().all(|word| word.bytes().all(|b| b.is_ascii_digit()));
        if first.starts_with("VHv") || text.lines().any(|l| l.trim().starts_with(TABLE_TITLE)) {
            Some(Self::VirtualHand)
        } else if first.starts_with('<') {
            Some(Self::JointXml)
        } else if is_shape {
            Some(Self::SlopeMatrix)
        } else if is_point_line(first) {
            Some(Self::PointList)
        } else if first.starts_with(['#', '[']) || first.contains('=') {
            Some(Self::Toml)
        } else {
            None
        }
    }
}

/// Reads a calibration in whatever form it is written.
///
/// Forms other than this program's own do not say which hand they are for; they are read as
/// for a right hand. A point list and a matrix are complete; in XML joints may be missing and
/// keep their default line.
///
/// # Errors
/// [`CalibrationError`] with the line and what was expected there.
pub fn read_calibration(text: &str) -> Result<(Calibration, Form), CalibrationError> {
    // Editors of some systems put a mark before the first character.
    let text = text.trim_start_matches('\u{feff}');
    let form = Form::of(text).ok_or(CalibrationError::UnknownForm)?;
    let read = match form {
        Form::Toml => read_toml(text),
        Form::VirtualHand => read_virtual_hand(text),
        Form::PointList => read_point_list(text),
        Form::JointXml => read_joint_xml(text),
        Form::SlopeMatrix => read_slope_matrix(text),
    };
    Ok((read?, form))
}

#[cfg(test)]
#[path = "form_tests.rs"]
mod tests;
