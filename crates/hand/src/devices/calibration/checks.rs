//! What a calibration may hold, and why a text is not one.

use super::linear::{Calibration, SensorCalibration};
use crate::devices::cyberglove::Sensor;

/// Why a text is not a calibration.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum CalibrationError {
    /// The text is not TOML, or does not have the fields of a calibration.
    #[error("not a calibration: {0}")]
    Syntax(String),
    /// The text is in none of the forms that are read.
    #[error(
        "not a calibration: it begins neither like TOML (`format = 1`), nor like a VirtualHand \
         file (`VHv…`), a list of points (`0.0:74 -0.4:98`), an XML list of joints \
         (`<Cyberglove_calibration>`) or a matrix of slopes (`20 24`)"
    )]
    UnknownForm,
    /// The file has a format number that this program does not read.
    #[error("calibration format {found}, this program reads {reads}")]
    Format {
        /// Format number of the file.
        found: u32,
        /// Format number that this program reads.
        reads: u32,
    },
    /// A line does not hold what must stand there.
    #[error("line {line}: expected {expected}, found `{found}`")]
    Line {
        /// Number of the line, from 1.
        line: usize,
        /// What the form demands in this line.
        expected: &'static str,
        /// Text of the line, cut to some 40 characters.
        found: String,
    },
    /// The text ends too early.
    #[error("the text ends where {expected} should follow")]
    Ends {
        /// What the form demands next.
        expected: &'static str,
    },
    /// A line is well formed, but what it says is impossible.
    #[error("line {line}: {error}")]
    At {
        /// Number of the line, from 1.
        line: usize,
        /// What is impossible.
        error: Box<CalibrationError>,
    },
    /// A sensor is listed twice.
    #[error("sensor {0:?} is listed twice")]
    Twice(Sensor),
    /// A sensor is not listed.
    #[error("sensor {0:?} is missing")]
    Missing(Sensor),
    /// A number that no calibration can have.
    #[error("{field} of sensor {sensor:?} is {value}, which cannot be")]
    Value {
        /// Sensor whose line holds the number.
        sensor: Sensor,
        /// Name of the field that holds the number.
        field: &'static str,
        /// Value of the field.
        value: f64,
    },
    /// The share of the middle finger is not between 0 and 1.
    #[error("middle_bias is {0}, it must be 0 to 1")]
    MiddleBias(f64),
    /// The thumb's two sensors cannot be told apart with this coupling.
    #[error(
        "thumb coupling {0} and {1} rad per count: with the gains of both thumb sensors it must \
         leave two different angles"
    )]
    ThumbCoupling(f64, f64),
}

impl CalibrationError {
    /// This error, with the number of the line that it is about.
    pub(super) fn at(self, line: usize) -> Self {
        Self::At { line, error: Box::new(self) }
    }

    /// The error about a line that does not hold what it should.
    pub(super) fn line(line: usize, expected: &'static str, found: &str) -> Self {
        let first = found.trim().lines().next().unwrap_or_default();
        Self::Line { line, expected, found: first.chars().take(40).collect() }
    }
}

/// Checks that one sensor's line turns every raw value into a finite angle and back.
pub(super) fn check_sensor(line: &SensorCalibration) -> Result<(), CalibrationError> {
    let sensor = line.sensor;
    let [low, high] = line.limits_rad;
    let rules = [
        ("offset_counts", line.offset_counts, line.offset_counts.abs() <= 1000.0),
        (
            "gain_rad_per_count",
            line.gain_rad_per_count,
            (1e-5..=1.0).contains(&line.gain_rad_per_count.abs()),
        ),
        ("limits_rad", low, low.abs() <= 4.0),
        ("limits_rad", high, high.abs() <= 4.0 && low <= high),
        ("rest_rad", line.rest_rad, (low..=high).contains(&line.rest_rad)),
    ];
    match rules.into_iter().find(|(_, _, holds)| !holds) {
        None => Ok(()),
        Some((field, value, _)) => Err(CalibrationError::Value { sensor, field, value }),
    }
}

/// Checks that a whole calibration turns every reading into finite angles and back.
pub(super) fn check(calibration: &Calibration) -> Result<(), CalibrationError> {
    for line in &calibration.sensors {
        check_sensor(line)?;
    }
    if !(0.0..=1.0).contains(&calibration.middle_bias) {
        return Err(CalibrationError::MiddleBias(calibration.middle_bias));
    }
    let coupling = calibration.thumb_coupling;
    if !coupling.is_invertible(calibration.thumb_gains()) {
        let [rotation, abduction] = coupling.terms();
        return Err(CalibrationError::ThumbCoupling(rotation, abduction));
    }
    Ok(())
}
