//! Camera-tracked hands as CSV: four joint places per finger and picture.

use nalgebra::Point3;
use softgrasp_grasp::hand::{Finger, Handedness};

/// The joints of a hand in one picture of the camera.
///
/// Units: m. Frame: the camera's, X right, Y up, Z toward the user.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LeapFrame {
    /// Time since the first picture, s.
    pub time_s: f64,
    /// Right or left hand.
    pub hand: Handedness,
    /// Thumb to little finger, each MPJ (thumb: TMJ), next joint, last joint, tip.
    pub joints: [[Point3<f64>; 4]; 5],
}

/// All pictures of a recording, in the order of the file.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LeapRecording {
    /// The pictures, one per row of the file.
    pub frames: Vec<LeapFrame>,
}

/// Why a text is not such a recording; rows count from 1, without the header.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum LeapError {
    /// A column is missing from the header.
    #[error("the header lacks column {column}")]
    Column {
        /// Name of the missing column.
        column: String,
    },
    /// A row cannot be read.
    #[error("row {row}: {reason}")]
    Row {
        /// Number of the row.
        row: usize,
        /// What is wrong with the row.
        reason: String,
    },
}

const JOINTS: [&str; 4] = ["mcp", "pip", "dip", "tip"];
const AXES: [&str; 3] = ["x", "y", "z"];

impl LeapRecording {
    /// Reads the text of a recording; columns are found by name, others are ignored.
    ///
    /// # Errors
    /// [`LeapError`] for a missing column or the first row that cannot be read.
    pub fn parse(text: &str) -> Result<Self, LeapError> {
        let mut reader = csv::Reader::from_reader(text.as_bytes());
        let header = reader.headers().map_err(|e| bad(0, &e))?.clone();
        let column = |name: String| {
            let found = header.iter().position(|h| h == name);
            found.ok_or(LeapError::Column { column: name })
        };
        let time = column("t_us".to_owned())?;
        let hand = column("hand_type".to_owned())?;
        let mut places = [[[0; 3]; 4]; 5];
        for finger in Finger::ALL {
            for (j, joint) in JOINTS.into_iter().enumerate() {
                for (a, axis) in AXES.into_iter().enumerate() {
                    let name = format!("{}_{joint}_{axis}", finger_word(finger));
                    places[finger.index()][j][a] = column(name)?;
                }
            }
        }
        let mut frames = Vec::new();
        let mut start_us = None;
        for (index, record) in reader.records().enumerate() {
            let row = index + 1;
            let record = record.map_err(|e| bad(row, &e))?;
            let number = |column: usize| number(&record, column, row);
            let time_us = number(time)?;
            let hand = match record.get(hand) {
                Some("left") => Handedness::Left,
                Some("right") => Handedness::Right,
                other => return Err(bad(row, &format!("hand {other:?} is not left or right"))),
            };
            let mut joints = [[Point3::origin(); 4]; 5];
            for (finger, columns) in joints.iter_mut().zip(&places) {
                for (joint, [x, y, z]) in finger.iter_mut().zip(columns) {
                    *joint = Point3::new(number(*x)?, number(*y)?, number(*z)?) * 1e-3;
                }
            }
            frames.push(LeapFrame {
                time_s: (time_us - *start_us.get_or_insert(time_us)) * 1e-6,
                hand,
                joints,
            });
        }
        Ok(Self { frames })
    }
}

impl LeapFrame {
    /// Lengths of the three segments of one finger, m.
    pub fn segment_lengths(&self, finger: Finger) -> [f64; 3] {
        let joints = &self.joints[finger.index()];
        [0, 1, 2].map(|i| (joints[i + 1] - joints[i]).norm())
    }
}

fn finger_word(finger: Finger) -> &'static str {
    match finger {
        Finger::Thumb => "thumb",
        Finger::Index => "index",
        Finger::Middle => "middle",
        Finger::Ring => "ring",
        Finger::Little => "pinky",
    }
}

fn bad(row: usize, reason: &impl ToString) -> LeapError {
    LeapError::Row { row, reason: reason.to_string() }
}

fn number(record: &csv::StringRecord, column: usize, row: usize) -> Result<f64, LeapError> {
    let field = record.get(column).unwrap_or_default();
    match field.trim().parse::<f64>() {
        Ok(value) if value.is_finite() => Ok(value),
        _ => Err(bad(row, &format!("{field:?} is not a finite number"))),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A recording of one picture with joint coordinates 1, 2, 3, … mm.
    fn text() -> String {
        let mut header = "t_us,hand_type".to_owned();
        let mut row = "1000,right".to_owned();
        let mut next = 0;
        for finger in Finger::ALL {
            for joint in JOINTS {
                for axis in AXES {
                    next += 1;
                    header.push_str(&format!(",{}_{joint}_{axis}", finger_word(finger)));
                    row.push_str(&format!(",{next}"));
                }
            }
        }
        format!("{header}\n{row}\n{}\n", row.replacen("1000,right", "9500,left", 1))
    }

    #[test]
    fn frames_are_read_by_column_name() {
        let recording = LeapRecording::parse(&text()).unwrap();
        let [first, second] = recording.frames[..] else { panic!("two frames") };
        assert_eq!((first.hand, second.hand), (Handedness::Right, Handedness::Left));
        assert!((second.time_s - 0.0085).abs() < 1e-15);
        let expected = Point3::new(58.0, 59.0, 60.0) * 1e-3;
        assert_eq!(first.joints[4][3], expected);
    }

    #[test]
    fn missing_columns_and_bad_rows_are_named() {
        let without = text().replace("ring_tip_y", "other");
        let column = "ring_tip_y".to_owned();
        assert_eq!(LeapRecording::parse(&without).unwrap_err(), LeapError::Column { column });
        for (from, to) in
            [("9500,left", "9500,both"), ("9500,left", "x,left"), ("9500,left", "9500")]
        {
            let error = LeapRecording::parse(&text().replace(from, to)).unwrap_err();
            assert!(matches!(error, LeapError::Row { row: 2, .. }), "{error}");
        }
    }
}
