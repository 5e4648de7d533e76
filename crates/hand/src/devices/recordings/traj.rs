//! Tracker trajectories as text: 4 × 4 matrices, four rows each, a blank line between poses.

use nalgebra::{Isometry3, Matrix3, Rotation3, Translation3, UnitQuaternion, Vector3};

/// Poses of one receiver, in the order of the file.
///
/// Units: m. Frame: the recording's base frame; there are no time stamps.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Trajectory {
    /// Receiver frame in the base frame.
    pub base_from_receiver: Vec<Isometry3<f64>>,
}

/// Why a text is not a trajectory; lines count from 1.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum TrajError {
    /// A row that is not four finite numbers.
    #[error("line {line}: a row must be four finite numbers")]
    Row {
        /// Number of the line.
        line: usize,
    },
    /// Another number of rows than four between blank lines.
    #[error("line {line}: a pose of {rows} rows, it must have four")]
    Rows {
        /// Last line of the pose.
        line: usize,
        /// Number of rows that the pose has.
        rows: usize,
    },
    /// The last row is not 0 0 0 1.
    #[error("line {line}: the last row of a pose must be 0 0 0 1")]
    LastRow {
        /// Number of the line.
        line: usize,
    },
    /// The rotation is sheared, scaled or mirrored.
    #[error("line {line}: not a rotation, it is off by {off:e}")]
    Rotation {
        /// Last line of the pose.
        line: usize,
        /// Largest entry of RᵀR − 1, or of a mirrored determinant's distance from 1.
        off: f64,
    },
    /// No pose at all.
    #[error("the trajectory has no pose")]
    Empty,
}

/// Printed rotations are rounded to six digits.
const ROTATION_TOLERANCE: f64 = 1e-3;

impl Trajectory {
    /// Reads the text of a `.traj` file; duplicates and jumps are kept, rotations are made exact.
    ///
    /// # Errors
    /// [`TrajError`] names the first line that cannot be read.
    pub fn parse(text: &str) -> Result<Self, TrajError> {
        let mut poses = Vec::new();
        let mut rows: Vec<[f64; 4]> = Vec::with_capacity(4);
        let mut last_line = 0;
        // A blank line at the end closes the last pose.
        for (index, line) in text.lines().chain([""]).enumerate() {
            if !line.trim().is_empty() {
                last_line = index + 1;
                rows.push(row(line).ok_or(TrajError::Row { line: last_line })?);
                if rows.len() > 4 {
                    return Err(TrajError::Rows { line: last_line, rows: rows.len() });
                }
            } else if !rows.is_empty() {
                poses.push(pose(&rows, last_line)?);
                rows.clear();
            }
        }
        if poses.is_empty() {
            return Err(TrajError::Empty);
        }
        Ok(Self { base_from_receiver: poses })
    }

    /// Poses that equal the one before, digit by digit.
    pub fn duplicate_count(&self) -> usize {
        self.base_from_receiver.windows(2).filter(|pair| pair[0] == pair[1]).count()
    }

    /// Longest way between successive poses, m.
    pub fn largest_step_m(&self) -> f64 {
        let step = |pair: &[Isometry3<f64>]| {
            (pair[1].translation.vector - pair[0].translation.vector).norm()
        };
        self.base_from_receiver.windows(2).map(step).fold(0.0, f64::max)
    }

    /// The poses without those that equal the one before.
    #[must_use]
    pub fn without_duplicates(mut self) -> Self {
        self.base_from_receiver.dedup();
        self
    }
}

fn row(line: &str) -> Option<[f64; 4]> {
    let mut numbers = line.split_whitespace();
    let mut row = [0.0; 4];
    for slot in &mut row {
        *slot = numbers.next()?.parse().ok().filter(|v: &f64| v.is_finite())?;
    }
    numbers.next().is_none().then_some(row)
}

fn pose(rows: &[[f64; 4]], line: usize) -> Result<Isometry3<f64>, TrajError> {
    let [x, y, z, last] = rows else {
        return Err(TrajError::Rows { line, rows: rows.len() });
    };
    if *last != [0.0, 0.0, 0.0, 1.0] {
        return Err(TrajError::LastRow { line });
    }
    let matrix = Matrix3::from_fn(|r, c| [x, y, z][r][c]);
    let shear = (matrix.transpose() * matrix - Matrix3::identity()).abs().max();
    let off = shear.max((matrix.determinant() - 1.0).abs());
    // A range, so that an overflow to NaN is refused too.
    if !(0.0..=ROTATION_TOLERANCE).contains(&off) {
        return Err(TrajError::Rotation { line, off });
    }
    let rotation = Rotation3::from_matrix_unchecked(matrix);
    let rotation =
        UnitQuaternion::new_normalize(UnitQuaternion::from_rotation_matrix(&rotation).into_inner());
    let translation = Translation3::from(Vector3::new(x[3], y[3], z[3]));
    Ok(Isometry3::from_parts(translation, rotation))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const TWO_POSES: &str = "1 0 0 0.5\n0 1 0 0\n0 0 1 0\n0 0 0 1\n\n\
                             0 -1 0 0.5\r\n1 0 0 2e-1\r\n0 0 1 0\r\n0 0 0 1\r\n";

    #[test]
    fn two_poses_are_read() {
        let trajectory = Trajectory::parse(TWO_POSES).unwrap();
        let [first, second] = trajectory.base_from_receiver[..] else { panic!("two poses") };
        assert_eq!(first, Isometry3::translation(0.5, 0.0, 0.0));
        assert!(((second * Vector3::x()) - Vector3::y()).norm() < 1e-15);
        assert!((trajectory.largest_step_m() - 0.2).abs() < 1e-15);
    }

    #[test]
    fn duplicates_are_counted_and_can_be_dropped() {
        let twice =
            format!("{TWO_POSES}\n\n{TWO_POSES}\n{}", TWO_POSES.split_once("\n\n").unwrap().1);
        let trajectory = Trajectory::parse(&twice).unwrap();
        assert_eq!(trajectory.base_from_receiver.len(), 5);
        assert_eq!(trajectory.duplicate_count(), 1);
        assert_eq!(trajectory.without_duplicates().base_from_receiver.len(), 4);
    }

    #[test]
    fn broken_files_are_refused_by_line() {
        let refused = |from, to| Trajectory::parse(&TWO_POSES.replacen(from, to, 1)).unwrap_err();
        assert_eq!(refused("0 1 0 0\n", "0 1 0\n"), TrajError::Row { line: 2 });
        assert_eq!(refused("0 1 0 0\n", "0 1 0 nan\n"), TrajError::Row { line: 2 });
        assert_eq!(refused("0 1 0 0\n", "0 1 0 0 0\n"), TrajError::Row { line: 2 });
        assert_eq!(refused("0 1 0 0\n", ""), TrajError::Rows { line: 3, rows: 3 });
        assert_eq!(refused("\n\n", "\n"), TrajError::Rows { line: 5, rows: 5 });
        assert_eq!(refused("0 0 0 1", "0 0 0 2"), TrajError::LastRow { line: 4 });
        assert!(matches!(refused("1 0 0 0.5", "-1 0 0 0"), TrajError::Rotation { line: 4, .. }));
        assert!(matches!(refused("1 0 0 0.5", "1e200 0 0 0"), TrajError::Rotation { .. }));
        assert_eq!(Trajectory::parse("\n \n").unwrap_err(), TrajError::Empty);
    }

    proptest! {
        #[test]
        fn any_text_is_read_or_refused(text in "[ 0-9.e\\-\n]{0,200}") {
            if let Ok(trajectory) = Trajectory::parse(&text) {
                prop_assert!(!trajectory.base_from_receiver.is_empty());
            }
        }
    }
}
