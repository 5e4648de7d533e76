//! Comment lines of a `.cal` file that hold what the vendor's table cannot.

use softgrasp_grasp::hand::Handedness;

use super::checks::CalibrationError;
use super::linear::{Calibration, DipRule};
use super::sensor_names::{file_name, sensor_of_file_name};
use crate::devices::cyberglove::Sensor;

/// Start of such a line.
pub(super) const NOTE_MARK: &str = "! softgrasp ";

/// Keys and values of a calibration, in the order in which they are written.
pub(super) fn notes_of(calibration: &Calibration) -> Vec<(String, String)> {
    let hand = calibration.hand.name();
    let [rotation, abduction] = calibration.thumb_coupling.terms();
    let mut notes = vec![
        ("hand".to_owned(), hand.to_owned()),
        ("dip_rule".to_owned(), dip_rule_name(calibration.dip_rule).to_owned()),
        ("middle_bias".to_owned(), calibration.middle_bias.to_string()),
    ];
    if !calibration.thumb_coupling.is_none() {
        notes.push(("rotation_rad_per_abduction_count".to_owned(), rotation.to_string()));
        notes.push(("abduction_rad_per_rotation_count".to_owned(), abduction.to_string()));
    }
    for line in &calibration.sensors {
        let name = file_name(line.sensor);
        let mut note = |key: &str, value: String| notes.push((format!("{name}.{key}"), value));
        note("offset_counts", line.offset_counts.to_string());
        note("gain_rad_per_count", line.gain_rad_per_count.to_string());
        note("lowest_rad", line.limits_rad[0].to_string());
        note("highest_rad", line.limits_rad[1].to_string());
        note("rest_rad", line.rest_rad.to_string());
        if line.dead {
            note("dead", "true".to_owned());
        }
    }
    notes
}

const DIP_RULES: [(&str, DipRule); 3] = [
    ("quadratic", DipRule::Quadratic),
    ("signed_quadratic", DipRule::SignedQuadratic),
    ("two_thirds", DipRule::TwoThirds),
];

fn dip_rule_name(rule: DipRule) -> &'static str {
    match rule {
        DipRule::Quadratic => DIP_RULES[0].0,
        DipRule::SignedQuadratic => DIP_RULES[1].0,
        DipRule::TwoThirds => DIP_RULES[2].0,
    }
}

/// Puts one note into a calibration whose table has been read.
///
/// `printed` is asked for offsets, gains and the middle share, which stand in the table as well:
/// it says how the table prints the number of this key. Where the table says another number the
/// table has been edited since, and it wins.
///
/// # Errors
/// [`CalibrationError::Line`] for an unknown key or a value that is none.
pub(super) fn apply_note(
    calibration: &mut Calibration,
    line: usize,
    note: &str,
    printed: impl Fn(Option<Sensor>, &str, f64) -> f64,
) -> Result<(), CalibrationError> {
    let wrong = |expected| CalibrationError::line(line, expected, note);
    let (key, value) =
        note.trim().split_once(' ').ok_or_else(|| wrong("`! softgrasp KEY VALUE`"))?;
    let value = value.trim();
    let number = || value.parse::<f64>().map_err(|_| wrong("a number behind the key"));
    let keep = |table: &mut f64, sensor, key: &str, exact: f64| {
        let same = |number| printed(sensor, key, number).to_bits();
        if same(exact) == same(*table) {
            *table = exact;
        }
    };
    if let Some((name, field)) = key.split_once('.') {
        let sensor = sensor_of_file_name(name).ok_or_else(|| wrong("the name of a sensor"))?;
        let entry = &mut calibration.sensors[sensor.index()];
        match field {
            "offset_counts" => keep(&mut entry.offset_counts, Some(sensor), field, number()?),
            "gain_rad_per_count" => {
                keep(&mut entry.gain_rad_per_count, Some(sensor), field, number()?);
            }
            "lowest_rad" => entry.limits_rad[0] = number()?,
            "highest_rad" => entry.limits_rad[1] = number()?,
            "rest_rad" => entry.rest_rad = number()?,
            "dead" => entry.dead = value.parse().map_err(|_| wrong("true or false"))?,
            _ => return Err(wrong("a known key of a sensor")),
        }
        return Ok(());
    }
    match key {
        "hand" => {
            calibration.hand = match value {
                "right" => Handedness::Right,
                "left" => Handedness::Left,
                _ => return Err(wrong("right or left")),
            };
        }
        "dip_rule" => {
            let rule = DIP_RULES.into_iter().find(|(name, _)| *name == value);
            let expected = "quadratic, signed_quadratic or two_thirds";
            calibration.dip_rule = rule.ok_or_else(|| wrong(expected))?.1;
        }
        "middle_bias" => keep(&mut calibration.middle_bias, None, key, number()?),
        "rotation_rad_per_abduction_count" => {
            calibration.thumb_coupling.rotation_rad_per_abduction_count = number()?;
        }
        "abduction_rad_per_rotation_count" => {
            calibration.thumb_coupling.abduction_rad_per_rotation_count = number()?;
        }
        _ => return Err(wrong("a known key")),
    }
    Ok(())
}
