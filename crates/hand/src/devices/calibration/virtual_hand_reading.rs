//! Reads the vendor's VirtualHand `.cal` text, the vendor's own and this program's.

use softgrasp_grasp::hand::Handedness;

use super::checks::{CalibrationError, check, check_sensor};
use super::linear::Calibration;
use super::virtual_hand::{SLOTS, Slot, printed_gain, printed_offset, vendor_gain};
use super::virtual_hand_notes::{NOTE_MARK, apply_note};
use crate::devices::cyberglove::Sensor;

/// First words of the section with the table.
pub(super) const TABLE_TITLE: &str = "GLOVE CALIBRATION";
/// First words of the section with the shape of the hand.
const GEOMETRY_TITLE: &str = "3D HAND GEOMETRY";
/// What the lines between the joints must be.
const FINGER_LINES: [&str; 6] =
    ["`FINGER 0:`", "`FINGER 1:`", "`FINGER 2:`", "`FINGER 3:`", "`FINGER 4:`", "`FINGER 5:`"];

/// What the lines of the joints must be.
const JOINT_LINES: [&str; 4] = [
    "joint 0, its offset and its gain",
    "joint 1, its offset and its gain",
    "joint 2, its offset and its gain",
    "joint 3, its offset and its gain",
];

/// One line of the table, and where it stands.
#[derive(Clone, Copy)]
struct Row {
    line: usize,
    offset: f64,
    gain: f64,
}

/// Section of the text in which the reader is.
#[derive(Clone, Copy)]
enum Place {
    /// Before the table.
    Head,
    /// In the table; next must come this joint of this finger, or with joint 4 a new finger.
    Table { finger: usize, joint: usize },
    /// In the geometry, of which only the hand is read.
    Geometry,
    /// Behind all that is read.
    Rest,
}

/// Everything that the text says.
struct Reading<'a> {
    rows: [[Option<Row>; 4]; 6],
    notes: Vec<(usize, &'a str)>,
    geometry_hand: Option<Handedness>,
}

/// Reads a VirtualHand text; what it does not say is that of the default calibration.
pub(super) fn read_virtual_hand(text: &str) -> Result<Calibration, CalibrationError> {
    let reading = gather(text)?;
    let mut calibration = Calibration::default();
    if let Some(hand) = reading.geometry_hand {
        calibration.hand = hand;
    }
    for (finger, joints) in SLOTS.iter().enumerate() {
        for (joint, &slot) in joints.iter().enumerate() {
            let expected = FINGER_LINES[finger];
            let row = reading.rows[finger][joint].ok_or(CalibrationError::Ends { expected })?;
            take_row(&mut calibration, slot, row)?;
        }
    }
    for (line, note) in reading.notes {
        apply_note(&mut calibration, line, note, printed)?;
    }
    check(&calibration)?;
    Ok(calibration)
}

/// How the table prints a number of this program.
fn printed(sensor: Option<Sensor>, key: &str, number: f64) -> f64 {
    match (sensor, key) {
        (Some(_), "offset_counts") => printed_offset(number),
        (Some(sensor), _) => printed_gain(vendor_gain(sensor, number)),
        (None, _) => printed_gain(number),
    }
}

fn gather(text: &str) -> Result<Reading<'_>, CalibrationError> {
    let mut reading = Reading { rows: [[None; 4]; 6], notes: Vec::new(), geometry_hand: None };
    let mut place = Place::Head;
    for (index, line) in text.lines().enumerate() {
        let number = index + 1;
        let words = line.trim();
        if let Some(note) = words.strip_prefix(NOTE_MARK) {
            reading.notes.push((number, note));
        }
        if words.is_empty() || words.starts_with('!') {
            continue;
        }
        place = match place {
            Place::Head if words.starts_with(TABLE_TITLE) => Place::Table { finger: 6, joint: 4 },
            Place::Table { joint: 4, .. } if words.starts_with(GEOMETRY_TITLE) => Place::Geometry,
            Place::Table { joint: 4, .. } => {
                let finger = finger_of(words)
                    .ok_or_else(|| CalibrationError::line(number, "`FINGER 0:` to 5", words))?;
                Place::Table { finger, joint: 0 }
            }
            Place::Table { finger, joint } => {
                let row = row_of(number, joint, words)?;
                if reading.rows[finger][joint].replace(row).is_some() {
                    let expected = "each finger once";
                    return Err(CalibrationError::line(number, expected, words));
                }
                Place::Table { finger, joint: joint + 1 }
            }
            Place::Geometry => {
                reading.geometry_hand = match words.split_whitespace().next() {
                    Some("LEFT") => Some(Handedness::Left),
                    Some("RIGHT") => Some(Handedness::Right),
                    _ => None,
                };
                Place::Rest
            }
            Place::Head | Place::Rest => place,
        };
    }
    match place {
        Place::Head => Err(CalibrationError::Ends { expected: "`GLOVE CALIBRATION follows:`" }),
        Place::Table { joint, .. } if joint < 4 => {
            Err(CalibrationError::Ends { expected: "the next joint of this finger" })
        }
        _ => Ok(reading),
    }
}

/// The number of a line `FINGER n:`.
fn finger_of(words: &str) -> Option<usize> {
    let number = words.strip_prefix("FINGER")?.trim().strip_suffix(':')?.trim();
    number.parse().ok().filter(|&finger| finger < SLOTS.len())
}

/// One line of the table: joint, offset, gain and, unused, a gesture.
fn row_of(line: usize, joint: usize, words: &str) -> Result<Row, CalibrationError> {
    let wrong = |expected| CalibrationError::line(line, expected, words);
    let mut fields = words.split_whitespace();
    let mut next = |expected| {
        let number = fields.next().and_then(|field| field.parse::<f64>().ok());
        number.filter(|number| number.is_finite()).ok_or_else(|| wrong(expected))
    };
    let expected = JOINT_LINES[joint];
    let [number, offset, gain] = [next(expected)?, next(expected)?, next(expected)?];
    if number != joint as f64 {
        return Err(wrong(expected));
    }
    Ok(Row { line, offset, gain })
}

/// Puts one line of the table into the calibration: the vendor's convention ends here.
fn take_row(calibration: &mut Calibration, slot: Slot, row: Row) -> Result<(), CalibrationError> {
    let spread = Sensor::MiddleIndexAbduction;
    let sensor = match slot {
        Slot::Unused => return Ok(()),
        Slot::MiddleAbduction => {
            calibration.sensors[spread.index()].offset_counts = row.offset;
            calibration.middle_bias = row.gain;
            spread
        }
        Slot::Sensor(_) | Slot::IndexAbduction => {
            let sensor = if let Slot::Sensor(sensor) = slot { sensor } else { spread };
            let entry = &mut calibration.sensors[sensor.index()];
            entry.offset_counts = row.offset;
            // A gain of zero is the vendor's way to leave a sensor out.
            entry.dead = row.gain == 0.0;
            if !entry.dead {
                entry.gain_rad_per_count = vendor_gain(sensor, row.gain);
            }
            sensor
        }
    };
    check_sensor(calibration.sensor(sensor)).map_err(|error| error.at(row.line))?;
    if (0.0..=1.0).contains(&calibration.middle_bias) {
        return Ok(());
    }
    Err(CalibrationError::MiddleBias(calibration.middle_bias).at(row.line))
}
