//! Motion of a rigid body: poses at moments, with even motion between them.

use nalgebra::{Isometry3, Quaternion, Translation3, UnitQuaternion};

/// Poses at ascending moments; before the first and after the last the body is at rest.
///
/// Units: s. Frame: from the body's to the world.
#[derive(Clone, Debug, PartialEq)]
pub struct Way {
    poses: Vec<(f64, Isometry3<f64>)>,
}

/// Why numbers describe no motion.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum WayError {
    /// There is no pose.
    #[error("poses is empty; give at least one [t, x, y, z, qw, qx, qy, qz]")]
    Empty,
    /// A number is not finite.
    #[error("pose {pose} (from 0) has a number that is not finite")]
    NotFinite {
        /// Position of the pose in the list.
        pose: usize,
    },
    /// A quaternion is zero.
    #[error("pose {pose} (from 0) has a quaternion of length 0; no turn is 1, 0, 0, 0")]
    NoTurn {
        /// Position of the pose in the list.
        pose: usize,
    },
    /// A moment is not later than the one before.
    #[error("pose {pose} (from 0) is at {time} s, not behind the one before at {before} s")]
    Order {
        /// Position of the pose in the list.
        pose: usize,
        /// Moment of the pose, s.
        time: f64,
        /// Moment of the pose before, s.
        before: f64,
    },
}

impl Way {
    /// Motion from the rows of a file.
    ///
    /// Shapes: each row time, x, y, z, then the quaternion w, x, y, z, which is normalised.
    ///
    /// # Errors
    /// [`WayError`] if the rows describe no motion.
    pub fn try_new(rows: &[[f64; 8]]) -> Result<Self, WayError> {
        let mut poses: Vec<(f64, Isometry3<f64>)> = Vec::with_capacity(rows.len());
        for (pose, row) in rows.iter().enumerate() {
            if !row.iter().all(|x| x.is_finite()) {
                return Err(WayError::NotFinite { pose });
            }
            let [time, x, y, z, w, i, j, k] = *row;
            let turn = UnitQuaternion::try_new(Quaternion::new(w, i, j, k), f64::MIN_POSITIVE)
                .ok_or(WayError::NoTurn { pose })?;
            if let Some(&(before, _)) = poses.last()
                && time <= before
            {
                return Err(WayError::Order { pose, time, before });
            }
            poses.push((time, Isometry3::from_parts(Translation3::new(x, y, z), turn)));
        }
        match poses.is_empty() {
            true => Err(WayError::Empty),
            false => Ok(Self { poses }),
        }
    }

    /// Pose at a moment: position and rotation change evenly from one pose to the next.
    pub fn at(&self, time: f64) -> Isometry3<f64> {
        let next = self.poses.partition_point(|(t, _)| *t <= time);
        match (next.checked_sub(1).map(|last| self.poses[last]), self.poses.get(next)) {
            (None, Some((_, first))) => *first,
            (Some((_, last)), None) => last,
            (Some((t0, from)), Some((t1, to))) => {
                let share = (time - t0) / (t1 - t0);
                let turn = from.rotation.rotation_to(&to.rotation).powf(share) * from.rotation;
                let place = from.translation.vector.lerp(&to.translation.vector, share);
                Isometry3::from_parts(place.into(), turn)
            }
            (None, None) => Isometry3::identity(),
        }
    }

    /// Moment of the last pose, s.
    pub fn end(&self) -> f64 {
        self.poses.last().map_or(0.0, |(t, _)| *t)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn body_goes_evenly_and_rests_before_and_after() {
        let half = std::f64::consts::FRAC_1_SQRT_2;
        let way = Way::try_new(&[
            [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0],
            [3.0, 0.2, 0.0, 0.0, half, 0.0, 0.0, half],
        ])
        .unwrap();
        assert_eq!(way.at(0.0).translation.x, 0.0);
        let middle = way.at(2.0);
        assert!((middle.translation.x - 0.1).abs() < 1e-15);
        assert!((middle.rotation.angle() - std::f64::consts::FRAC_PI_4).abs() < 1e-12);
        assert_eq!((way.at(9.0).translation.x, way.end()), (0.2, 3.0));
    }

    #[test]
    fn rows_that_make_no_way_are_refused_by_number() {
        let still = [0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0];
        assert_eq!(Way::try_new(&[]), Err(WayError::Empty));
        let no_turn = [0.0; 8];
        assert_eq!(Way::try_new(&[no_turn]), Err(WayError::NoTurn { pose: 0 }));
        assert!(matches!(Way::try_new(&[still, still]), Err(WayError::Order { pose: 1, .. })));
        let nan = [f64::NAN, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0];
        assert_eq!(Way::try_new(&[nan]), Err(WayError::NotFinite { pose: 0 }));
    }
}
