//! Reads calibrations as a matrix: every angle a weighted sum of all readings and a constant.

use super::checks::{CalibrationError, check, check_sensor};
use super::linear::{Calibration, SensorCalibration};
use super::thumb::{THUMB_ROOT, ThumbCoupling};
use crate::devices::cyberglove::Sensor;

/// Rows of the matrix: the joints of GraspIt's human hand.
const ROWS: usize = 20;
/// Row of the thumb's turn across the palm and row of its turn away from the index finger.
///
/// The files do not name their rows; the row whose angle grows with both readings is taken for the
/// rotation, the one that falls with the rotation sensor for the abduction.
const THUMB_ROWS: [usize; 2] = [17, 16];

/// Joint of each other row, and the sign that turns its angle into this program's.
///
/// Index and ring finger turn about one axis there, so a spread is positive apart for the ring and
/// little finger and negative for the index finger. The middle finger's own row has no sensor.
const JOINTS: [(usize, Sensor, f64); 17] = [
    (0, Sensor::MiddleIndexAbduction, -1.0),
    (1, Sensor::IndexMcp, 1.0),
    (2, Sensor::IndexPip, 1.0),
    (3, Sensor::IndexDip, 1.0),
    (5, Sensor::MiddleMcp, 1.0),
    (6, Sensor::MiddlePip, 1.0),
    (7, Sensor::MiddleDip, 1.0),
    (8, Sensor::RingMiddleAbduction, 1.0),
    (9, Sensor::RingMcp, 1.0),
    (10, Sensor::RingPip, 1.0),
    (11, Sensor::RingDip, 1.0),
    (12, Sensor::LittleRingAbduction, 1.0),
    (13, Sensor::LittleMcp, 1.0),
    (14, Sensor::LittlePip, 1.0),
    (15, Sensor::LittleDip, 1.0),
    (18, Sensor::ThumbMcp, 1.0),
    (19, Sensor::ThumbIp, 1.0),
];

/// The numbers of the text.
struct Matrix {
    /// Slopes by row and sensor.
    slopes: [[f64; 22]; ROWS],
    constants: [f64; ROWS],
    /// Line of each row's first number.
    lines: [usize; ROWS],
}

/// Reads `20 24`, 20 rows of slopes in rad per count in wire order, 20 constants in rad.
///
/// 22 to 24 columns; those behind the 22 sensors are unused. Palm and wrist have no rows and keep
/// their default lines, as do joints without a slope. The thumb's two rows become its coupling;
/// a weight of any other foreign sensor is taken at that sensor's own zero.
pub(super) fn read_slope_matrix(text: &str) -> Result<Calibration, CalibrationError> {
    let matrix = numbers(text)?;
    let mut calibration = Calibration::default();
    for (row, sensor, sign) in JOINTS {
        let slope = sign * matrix.slopes[row][sensor.index()];
        if slope.abs() < 1e-5 {
            continue;
        }
        let foreign: f64 = Sensor::ALL
            .into_iter()
            .filter(|&other| other != sensor)
            .map(|other| {
                matrix.slopes[row][other.index()] * calibration.sensor(other).offset_counts
            })
            .sum();
        let line = SensorCalibration {
            offset_counts: -sign * (matrix.constants[row] + foreign) / slope,
            gain_rad_per_count: slope,
            ..*calibration.sensor(sensor)
        };
        check_sensor(&line).map_err(|error| error.at(matrix.lines[row]))?;
        calibration.sensors[sensor.index()] = line;
    }
    take_thumb(&mut calibration, &matrix)?;
    check(&calibration)?;
    Ok(calibration)
}

/// The two coupled rows of the thumb: gains, cross terms, and the readings where both are zero.
fn take_thumb(calibration: &mut Calibration, matrix: &Matrix) -> Result<(), CalibrationError> {
    let [s, c] =
        [0, 1].map(|i| THUMB_ROOT.map(|sensor| matrix.slopes[THUMB_ROWS[i]][sensor.index()]));
    if s == [0.0; 2] && c == [0.0; 2] {
        return Ok(());
    }
    let coupling = ThumbCoupling {
        rotation_rad_per_abduction_count: s[1],
        abduction_rad_per_rotation_count: c[0],
    };
    let gains = [s[0], c[1]];
    let line = matrix.lines[THUMB_ROWS[0]];
    if !coupling.is_invertible(gains) {
        return Err(CalibrationError::ThumbCoupling(s[1], c[0]).at(line));
    }
    let zero = coupling.counts(gains, THUMB_ROWS.map(|row| -matrix.constants[row]));
    for (i, sensor) in THUMB_ROOT.into_iter().enumerate() {
        let entry = SensorCalibration {
            offset_counts: zero[i],
            gain_rad_per_count: gains[i],
            ..*calibration.sensor(sensor)
        };
        check_sensor(&entry).map_err(|error| error.at(line))?;
        calibration.sensors[sensor.index()] = entry;
    }
    calibration.thumb_coupling = coupling;
    Ok(())
}

fn numbers(text: &str) -> Result<Matrix, CalibrationError> {
    let mut words = text
        .lines()
        .enumerate()
        .flat_map(|(index, line)| line.split_whitespace().map(move |word| (index + 1, word)));
    let mut next = |expected: &'static str| -> Result<(usize, f64), CalibrationError> {
        let (line, word) = words.next().ok_or(CalibrationError::Ends { expected })?;
        let number = word.parse::<f64>().ok().filter(|number| number.abs() <= 1e4);
        let number = number.ok_or_else(|| CalibrationError::line(line, expected, word))?;
        Ok((line, number))
    };
    let shape = "`20 24`: rows and columns";
    let ((line, rows), (_, columns)) = (next(shape)?, next(shape)?);
    let columns = [22.0, 23.0, 24.0].iter().position(|&c| c == columns).map(|extra| 22 + extra);
    let (Some(columns), true) = (columns, rows == ROWS as f64) else {
        return Err(CalibrationError::line(line, "20 rows and 22 to 24 columns", text));
    };
    let mut matrix = Matrix { slopes: [[0.0; 22]; ROWS], constants: [0.0; ROWS], lines: [0; ROWS] };
    for row in 0..ROWS {
        for column in 0..columns {
            let (line, slope) = next("a slope in rad per count")?;
            if column == 0 {
                matrix.lines[row] = line;
            }
            if let Some(place) = matrix.slopes[row].get_mut(column) {
                *place = slope;
            }
        }
    }
    for row in 0..ROWS {
        matrix.constants[row] = next("a constant in rad for each row")?.1;
    }
    match words.next() {
        None => Ok(matrix),
        Some((line, word)) => {
            Err(CalibrationError::line(line, "nothing behind the constants", word))
        }
    }
}
