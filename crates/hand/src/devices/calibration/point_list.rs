//! Reads calibrations as lists of points: one line a joint, `angle:reading angle:reading`.

use super::checks::{CalibrationError, check, check_sensor};
use super::linear::Calibration;
use super::straight_line::{Point, line_through};
use crate::devices::cyberglove::Sensor;

/// Sensor of each line, and the sign that turns its angle into this program's.
///
/// The lines follow the public library that writes such files (ASR): wrist, thumb, index, middle
/// with the palm in the place of its abduction, ring, little. There flexion is negative. The signs
/// of the sideways angles are read off its two public files: with them every spread grows with the
/// reading, as in the vendor's table, and the wrist turns further to the little finger's side.
const LINES: [(Sensor, f64); 22] = [
    (Sensor::WristYaw, 1.0),
    (Sensor::WristPitch, -1.0),
    (Sensor::ThumbAbduction, -1.0),
    (Sensor::ThumbRotation, -1.0),
    (Sensor::ThumbMcp, -1.0),
    (Sensor::ThumbIp, -1.0),
    (Sensor::IndexMcp, -1.0),
    (Sensor::MiddleIndexAbduction, -1.0),
    (Sensor::IndexPip, -1.0),
    (Sensor::IndexDip, -1.0),
    (Sensor::MiddleMcp, -1.0),
    (Sensor::PalmArch, -1.0),
    (Sensor::MiddlePip, -1.0),
    (Sensor::MiddleDip, -1.0),
    (Sensor::RingMcp, -1.0),
    (Sensor::RingMiddleAbduction, 1.0),
    (Sensor::RingPip, -1.0),
    (Sensor::RingDip, -1.0),
    (Sensor::LittleMcp, -1.0),
    (Sensor::LittleRingAbduction, 1.0),
    (Sensor::LittlePip, -1.0),
    (Sensor::LittleDip, -1.0),
];

/// Form of a line, for error messages.
const EXPECTED: &str = "`angle_rad:reading angle_rad:reading`";

/// Reads 22 lines of points; a line with one angle only keeps the default line of its sensor.
pub(super) fn read_point_list(text: &str) -> Result<Calibration, CalibrationError> {
    let mut calibration = Calibration::default();
    let mut written = text.lines().enumerate().filter(|(_, line)| !line.trim().is_empty());
    for (sensor, sign) in LINES {
        let expected = "22 lines of points, one a joint";
        let (index, line) = written.next().ok_or(CalibrationError::Ends { expected })?;
        let number = index + 1;
        let points = line
            .split_whitespace()
            .map(|word| point(word, sign))
            .collect::<Option<Vec<Point>>>()
            .filter(|points| points.len() >= 2)
            .ok_or_else(|| CalibrationError::line(number, EXPECTED, line))?;
        let fitted = line_through(calibration.sensor(sensor), &points);
        check_sensor(&fitted).map_err(|error| error.at(number))?;
        calibration.sensors[sensor.index()] = fitted;
    }
    if let Some((index, line)) = written.next() {
        return Err(CalibrationError::line(index + 1, "no more than 22 lines of points", line));
    }
    check(&calibration)?;
    Ok(calibration)
}

fn point(word: &str, sign: f64) -> Option<Point> {
    let (angle, counts) = word.split_once(':')?;
    let [angle, counts] = [angle, counts].map(|text| text.parse::<f64>().ok());
    let (angle, counts) = (angle?, counts?);
    let sound = angle.abs() <= 10.0 && counts.abs() <= 1000.0;
    sound.then_some(Point { counts, angle_rad: sign * angle })
}

/// Whether a line looks like one of a point list.
pub(super) fn is_point_line(line: &str) -> bool {
    line.split_whitespace().next().is_some_and(|word| point(word, 1.0).is_some())
}
