//! Calibration as TOML text, checked when it is read.

use serde::{Deserialize, Serialize};
use softgrasp_core::hand::Handedness;

use super::linear::{Calibration, DipRule, SensorCalibration};
use crate::devices::cyberglove::Sensor;

/// Version of the text; raised when an old reader would misread a new file.
const FORMAT: u32 = 1;

/// Why a text is not a calibration.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum CalibrationError {
    /// Not TOML, or not with these fields.
    #[error("not a calibration: {0}")]
    Syntax(String),
    /// Written by another version.
    #[error("calibration format {found}, this program reads {FORMAT}")]
    Format {
        /// The file's format.
        found: u32,
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
        /// Whose line.
        sensor: Sensor,
        /// Which field.
        field: &'static str,
        /// Its value.
        value: f64,
    },
    /// The share of the middle finger is not between 0 and 1.
    #[error("middle_bias is {0}, it must be 0 to 1")]
    MiddleBias(f64),
}

/// The words of the file.
#[derive(Clone, Copy, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
enum Hand {
    Right,
    Left,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct CalibrationText {
    format: u32,
    hand: Hand,
    dip_rule: DipRule,
    middle_bias: f64,
    sensor: Vec<SensorCalibration>,
}

impl Calibration {
    /// Reads the text written by [`Calibration::to_toml`]; sensors may come in any order.
    ///
    /// # Errors
    /// [`CalibrationError`] for anything but one sound line for each of the 22 sensors.
    pub fn from_toml(text: &str) -> Result<Self, CalibrationError> {
        let read: CalibrationText =
            toml::from_str(text).map_err(|e| CalibrationError::Syntax(e.to_string()))?;
        if read.format != FORMAT {
            return Err(CalibrationError::Format { found: read.format });
        }
        if !(0.0..=1.0).contains(&read.middle_bias) {
            return Err(CalibrationError::MiddleBias(read.middle_bias));
        }
        let mut lines: [Option<SensorCalibration>; 22] = [None; 22];
        for line in read.sensor {
            check(&line)?;
            if lines[line.sensor.index()].replace(line).is_some() {
                return Err(CalibrationError::Twice(line.sensor));
            }
        }
        let mut sensors = Self::default().sensors;
        for sensor in Sensor::ALL {
            let line = lines[sensor.index()].ok_or(CalibrationError::Missing(sensor))?;
            sensors[sensor.index()] = line;
        }
        Ok(Self {
            hand: match read.hand {
                Hand::Right => Handedness::Right,
                Hand::Left => Handedness::Left,
            },
            dip_rule: read.dip_rule,
            middle_bias: read.middle_bias,
            sensors,
        })
    }

    /// The calibration as TOML text; every number comes back exactly.
    ///
    /// # Errors
    /// [`CalibrationError::Syntax`] if the text cannot be made, which no field value causes.
    pub fn to_toml(&self) -> Result<String, CalibrationError> {
        let text = CalibrationText {
            format: FORMAT,
            hand: match self.hand {
                Handedness::Right => Hand::Right,
                Handedness::Left => Hand::Left,
            },
            dip_rule: self.dip_rule,
            middle_bias: self.middle_bias,
            sensor: self.sensors.to_vec(),
        };
        toml::to_string(&text).map_err(|e| CalibrationError::Syntax(e.to_string()))
    }

    /// The same calibration with one line replaced.
    ///
    /// # Errors
    /// [`CalibrationError::Value`] if a number of the line cannot be.
    pub fn with_sensor(mut self, line: SensorCalibration) -> Result<Self, CalibrationError> {
        check(&line)?;
        self.sensors[line.sensor.index()] = line;
        Ok(self)
    }
}

/// Whether a line can turn every raw value into a finite angle and back.
fn check(line: &SensorCalibration) -> Result<(), CalibrationError> {
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

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn text() -> String {
        Calibration::default().to_toml().unwrap()
    }

    #[test]
    fn defaults_survive_being_written_and_read() {
        let default = Calibration::default();
        assert_eq!(Calibration::from_toml(&text()).unwrap(), default);
        let left = Calibration { hand: Handedness::Left, dip_rule: DipRule::TwoThirds, ..default };
        assert_eq!(Calibration::from_toml(&left.to_toml().unwrap()).unwrap(), left);
    }

    #[test]
    fn files_that_cannot_be_used_are_refused_with_the_reason() {
        let refused = |from: &str, to: &str| {
            let changed = text().replacen(from, to, 1);
            assert_ne!(changed, text(), "{from} is in the text");
            Calibration::from_toml(&changed).unwrap_err()
        };
        assert_eq!(refused("format = 1", "format = 2"), CalibrationError::Format { found: 2 });
        assert_eq!(
            refused("\"thumb_mcp\"", "\"thumb_rotation\""),
            CalibrationError::Twice(Sensor::ThumbRotation)
        );
        assert_eq!(
            refused("middle_bias = 0.5", "middle_bias = nan").to_string(),
            "middle_bias is NaN, it must be 0 to 1"
        );
        for (from, to) in [
            ("gain_rad_per_count = 0.01584", "gain_rad_per_count = 0.0"),
            ("offset_counts = 60.0", "offset_counts = inf"),
            ("limits_rad = [-0.5, 1.6]", "limits_rad = [1.6, -0.5]"),
            ("rest_rad = 0.0", "rest_rad = 3.0"),
        ] {
            let error = refused(from, to);
            assert!(
                matches!(error, CalibrationError::Value { sensor: Sensor::ThumbRotation, .. }),
                "{error}"
            );
        }
        for (from, to) in [("hand = \"right\"", "hand = \"both\""), ("dead", "dread")] {
            assert!(matches!(refused(from, to), CalibrationError::Syntax(_)));
        }
        let short = text().rsplit_once("[[sensor]]").unwrap().0.to_owned();
        let error = Calibration::from_toml(&short).unwrap_err();
        assert_eq!(error, CalibrationError::Missing(Sensor::WristYaw));
    }

    proptest! {
        #[test]
        fn damaged_text_is_read_or_refused_but_never_worse(
            place in any::<prop::sample::Index>(), byte in 0x20u8..0x7f,
        ) {
            let mut damaged = text().into_bytes();
            let place = place.index(damaged.len());
            damaged[place] = byte;
            if let Ok(read) = Calibration::from_toml(std::str::from_utf8(&damaged).unwrap()) {
                for line in &read.sensors {
                    prop_assert!(check(line).is_ok());
                }
            }
        }
    }
}
