//! Calibration as TOML text, checked when it is read.

use serde::{Deserialize, Serialize};
use softgrasp_grasp::hand::Handedness;

use super::checks::{CalibrationError, check, check_sensor};
use super::linear::{Calibration, DipRule, SensorCalibration};
use super::thumb::ThumbCoupling;
use crate::devices::cyberglove::Sensor;

/// Version of the text; raised when an old reader would misread a new file.
const FORMAT: u32 = 1;

/// Words for right and left hand in the file.
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
    // Files written before there was a coupling have none.
    #[serde(default, skip_serializing_if = "ThumbCoupling::is_none")]
    thumb_coupling: ThumbCoupling,
    sensor: Vec<SensorCalibration>,
}

/// Reads the text written by [`toml_text`]; sensors may come in any order.
///
/// # Errors
/// [`CalibrationError`] for anything but one sound line for each of the 22 sensors.
pub fn read_toml(text: &str) -> Result<Calibration, CalibrationError> {
    let read: CalibrationText =
        toml::from_str(text).map_err(|e| CalibrationError::Syntax(e.to_string()))?;
    if read.format != FORMAT {
        return Err(CalibrationError::Format { found: read.format, reads: FORMAT });
    }
    let mut lines: [Option<SensorCalibration>; 22] = [None; 22];
    for line in read.sensor {
        check_sensor(&line)?;
        if lines[line.sensor.index()].replace(line).is_some() {
            return Err(CalibrationError::Twice(line.sensor));
        }
    }
    let mut sensors = Calibration::default().sensors;
    for sensor in Sensor::ALL {
        let line = lines[sensor.index()].ok_or(CalibrationError::Missing(sensor))?;
        sensors[sensor.index()] = line;
    }
    let calibration = Calibration {
        hand: match read.hand {
            Hand::Right => Handedness::Right,
            Hand::Left => Handedness::Left,
        },
        dip_rule: read.dip_rule,
        middle_bias: read.middle_bias,
        thumb_coupling: read.thumb_coupling,
        sensors,
    };
    check(&calibration)?;
    Ok(calibration)
}

/// The calibration as TOML text; every number comes back exactly.
///
/// # Errors
/// [`CalibrationError::Syntax`] if the text cannot be made, which no field value causes.
pub fn toml_text(calibration: &Calibration) -> Result<String, CalibrationError> {
    let text = CalibrationText {
        format: FORMAT,
        hand: match calibration.hand {
            Handedness::Right => Hand::Right,
            Handedness::Left => Hand::Left,
        },
        dip_rule: calibration.dip_rule,
        middle_bias: calibration.middle_bias,
        thumb_coupling: calibration.thumb_coupling,
        sensor: calibration.sensors.to_vec(),
    };
    toml::to_string(&text).map_err(|e| CalibrationError::Syntax(e.to_string()))
}

/// A calibration with the line of one sensor replaced.
///
/// # Errors
/// [`CalibrationError::Value`] if a number of the line cannot be.
pub fn with_sensor(
    mut calibration: Calibration,
    line: SensorCalibration,
) -> Result<Calibration, CalibrationError> {
    calibration.sensors[line.sensor.index()] = line;
    check(&calibration)?;
    Ok(calibration)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn text() -> String {
        toml_text(&Calibration::default()).unwrap()
    }

    #[test]
    fn defaults_survive_being_written_and_read() {
        let default = Calibration::default();
        assert_eq!(read_toml(&text()).unwrap(), default);
        let left = Calibration { hand: Handedness::Left, dip_rule: DipRule::TwoThirds, ..default };
        assert_eq!(read_toml(&toml_text(&left).unwrap()).unwrap(), left);
        let thumb_coupling = ThumbCoupling {
            rotation_rad_per_abduction_count: 0.001,
            abduction_rad_per_rotation_count: -0.002,
        };
        let coupled = Calibration { thumb_coupling, ..left };
        assert_eq!(read_toml(&toml_text(&coupled).unwrap()).unwrap(), coupled);
    }

    #[test]
    fn a_text_without_a_coupling_is_an_older_file_and_has_none() {
        assert!(!text().contains("coupling"));
        assert!(read_toml(&text()).unwrap().thumb_coupling.is_none());
        let merged = text().replacen(
            "middle_bias = 0.5",
            "middle_bias = 0.5\nthumb_coupling = { rotation_rad_per_abduction_count = 0.01584, \
             abduction_rad_per_rotation_count = 0.00502 }",
            1,
        );
        let error = read_toml(&merged).unwrap_err();
        assert_eq!(error, CalibrationError::ThumbCoupling(0.01584, 0.00502));
    }

    #[test]
    fn files_that_cannot_be_used_are_refused_with_the_reason() {
        let refused = |from: &str, to: &str| {
            let changed = text().replacen(from, to, 1);
            assert_ne!(changed, text(), "{from} is in the text");
            read_toml(&changed).unwrap_err()
        };
        assert_eq!(
            refused("format = 1", "format = 2"),
            CalibrationError::Format { found: 2, reads: 1 }
        );
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
        let error = read_toml(&short).unwrap_err();
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
            if let Ok(read) = read_toml(std::str::from_utf8(&damaged).unwrap()) {
                for line in &read.sensors {
                    prop_assert!(check_sensor(line).is_ok());
                }
            }
        }
    }
}
