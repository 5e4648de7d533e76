//! The mean of poses that should be one, without the few that are not.

use nalgebra::{Isometry3, Matrix4, Quaternion, SymmetricEigen, UnitQuaternion, Vector3};

use super::error::AlignmentError;

/// A pose averaged over records of a resting receiver.
///
/// Units: m, rad. Frame: that of the poses.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AveragedPose {
    /// The mean pose.
    pub pose: Isometry3<f64>,
    /// Number of records that were averaged.
    pub used: usize,
    /// Number of records that were left out.
    pub left_out: usize,
    /// Largest distance of an averaged record from the mean position.
    pub spread_m: f64,
    /// Largest angle between an averaged record and the mean attitude.
    pub spread_rad: f64,
}

/// Fewest records that are averaged.
const NEEDED: usize = 10;
/// A record this many times the median deviation away is left out.
pub(super) const OUTLIER_MEDIANS: f64 = 3.0;
/// Distance and angle within which no record is left out: what the tracker's last digits amount to, m and
/// rad.
pub(super) const FLOOR_M: f64 = 3e-4;
const FLOOR_RAD: f64 = 1e-3;
/// Largest distance and angle of a resting hand from its mean pose, m and rad.
const MAX_SPREAD_M: f64 = 5e-3;
const MAX_SPREAD_RAD: f64 = 2.0 * std::f64::consts::PI / 180.0;

/// Averages the poses of a resting receiver.
///
/// Places are averaged as they are, attitudes as the quaternion nearest to all of them. Poses
/// farther than three median deviations from the middle, in place or attitude, are left out.
///
/// # Errors
/// [`AlignmentError`] for too few poses, a hand that moved by more than 5 mm or 2°, or more than a
/// fifth of the poses left out.
pub fn average_pose(poses: &[Isometry3<f64>]) -> Result<AveragedPose, AlignmentError> {
    let poses = sound(poses);
    if poses.len() < NEEDED {
        return Err(AlignmentError::TooFew { got: poses.len(), needed: NEEDED });
    }
    let middle = Isometry3::from_parts(middle_place(&poses).into(), mean_rotation(&poses));
    let deviations: Vec<[f64; 2]> = poses.iter().map(|pose| deviation(&middle, pose)).collect();
    let most = [(0, FLOOR_M), (1, FLOOR_RAD)].map(|(part, floor)| {
        let median = median(deviations.iter().map(|deviation| deviation[part]).collect());
        (OUTLIER_MEDIANS * median).max(floor)
    });
    let near: Vec<Isometry3<f64>> = (poses.iter().zip(&deviations))
        .filter(|(_, deviation)| deviation[0] <= most[0] && deviation[1] <= most[1])
        .map(|(pose, _)| *pose)
        .collect();
    let left_out = poses.len() - near.len();
    if near.is_empty() || 5 * left_out > poses.len() {
        return Err(AlignmentError::Scattered { left_out, of: poses.len() });
    }
    let place = near.iter().map(|pose| pose.translation.vector).sum::<Vector3<f64>>();
    let pose = Isometry3::from_parts((place / near.len() as f64).into(), mean_rotation(&near));
    let largest =
        |part: usize| near.iter().map(|record| deviation(&pose, record)[part]).fold(0.0, f64::max);
    let (spread_m, spread_rad) = (largest(0), largest(1));
    if spread_m > MAX_SPREAD_M || spread_rad > MAX_SPREAD_RAD {
        return Err(AlignmentError::Moved { spread_m, spread_rad });
    }
    Ok(AveragedPose { pose, used: near.len(), left_out, spread_m, spread_rad })
}

/// The poses within 100 m whose quaternion is about of unit length; others are no records of a tracker.
pub(super) fn sound(poses: &[Isometry3<f64>]) -> Vec<Isometry3<f64>> {
    let is_sound = |pose: &&Isometry3<f64>| {
        let length = pose.rotation.quaternion().norm();
        pose.translation.vector.norm() <= 100.0 && (0.9..=1.1).contains(&length)
    };
    poses.iter().filter(is_sound).copied().collect()
}

/// Distance (m) and angle (rad) between two poses.
fn deviation(from: &Isometry3<f64>, to: &Isometry3<f64>) -> [f64; 2] {
    let way = (to.translation.vector - from.translation.vector).norm();
    [way, to.rotation.angle_to(&from.rotation)]
}

/// Median of each coordinate: few far poses do not move it.
fn middle_place(poses: &[Isometry3<f64>]) -> Vector3<f64> {
    Vector3::from_fn(|axis, _| median(poses.iter().map(|p| p.translation.vector[axis]).collect()))
}

/// Median of the values; 0 for an empty list.
pub(super) fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or(0.0)
}

/// The rotation with the least squared chordal distance to all: the largest eigenvector of the sum
/// of q qᵀ, in which q and −q count alike.
fn mean_rotation(poses: &[Isometry3<f64>]) -> UnitQuaternion<f64> {
    let sum: Matrix4<f64> = poses
        .iter()
        .map(|pose| {
            pose.rotation.quaternion().coords * pose.rotation.quaternion().coords.transpose()
        })
        .sum();
    let eigen = SymmetricEigen::new(sum);
    let largest = eigen.eigenvalues.imax();
    let vector = eigen.eigenvectors.column(largest).into_owned();
    UnitQuaternion::new_normalize(Quaternion::from_vector(vector))
}

#[cfg(test)]
mod tests {
    use super::super::synthetic::Noise;
    use super::*;
    use proptest::prelude::*;

    fn any_pose() -> impl Strategy<Value = Isometry3<f64>> {
        let numbers = (prop::array::uniform3(-1.0..1.0f64), prop::array::uniform3(-3.0..3.0f64));
        numbers.prop_map(|(shift, turn)| Isometry3::new(shift.into(), turn.into()))
    }

    proptest! {
        #[test]
        fn noise_of_a_tracker_averages_out(truth in any_pose(), seed in any::<u64>()) {
            let mut noise = Noise::new(seed);
            let mut poses: Vec<_> = (0..100).map(|_| noise.around(&truth)).collect();
            // Half of the quaternions with the other sign: the same rotations.
            for pose in poses.iter_mut().step_by(2) {
                pose.rotation = UnitQuaternion::new_unchecked(-pose.rotation.into_inner());
            }
            let average = average_pose(&poses).unwrap();
            let [way, turn] = deviation(&truth, &average.pose);
            // Noise of 0.8 mm and 0.15° over ten: 0.08 mm and 0.015°, here five of these.
            prop_assert!(way < 4e-4, "{way}");
            prop_assert!(turn.to_degrees() < 0.075, "{}", turn.to_degrees());
            prop_assert!(average.left_out <= 5);
            prop_assert!(average.spread_m < 4e-3 && average.spread_rad.to_degrees() < 0.8);
        }

        #[test]
        fn a_few_wild_records_change_nothing(
            truth in any_pose(), wild in prop::collection::vec(any_pose(), 8), seed in any::<u64>(),
        ) {
            let mut noise = Noise::new(seed);
            let mut poses: Vec<_> = (0..100).map(|_| noise.around(&truth)).collect();
            for (i, pose) in wild.into_iter().enumerate() {
                poses[11 * i] = pose;
            }
            poses[99].translation.vector.x = f64::NAN;
            poses[98] = Isometry3::from_parts(
                (-truth.translation.vector).into(), truth.rotation,
            );
            let average = average_pose(&poses).unwrap();
            let [way, turn] = deviation(&truth, &average.pose);
            prop_assert!(way < 6e-4, "{way}");
            prop_assert!(turn.to_degrees() < 0.15, "{}", turn.to_degrees());
        }
    }

    #[test]
    fn a_hand_that_moves_is_refused_with_its_way() {
        let mut noise = Noise::new(3);
        let truth = Isometry3::new(Vector3::new(0.3, 0.1, -0.4), Vector3::new(0.2, 0.1, 0.3));
        let drifting: Vec<_> = (0..100)
            .map(|i| {
                let mut pose = noise.around(&truth);
                pose.translation.vector.x += 0.02 * f64::from(i) / 100.0;
                pose
            })
            .collect();
        let Err(AlignmentError::Moved { spread_m, .. }) = average_pose(&drifting) else {
            panic!("20 mm of drift")
        };
        assert!((0.009..0.014).contains(&spread_m), "{spread_m}");
        let turning: Vec<_> = (0..100)
            .map(|i| {
                let angle = (6.0 * f64::from(i) / 100.0f64).to_radians();
                let turn = UnitQuaternion::from_axis_angle(&Vector3::y_axis(), angle);
                Isometry3::from_parts(truth.translation, turn * truth.rotation)
            })
            .collect();
        assert!(matches!(average_pose(&turning), Err(AlignmentError::Moved { .. })));
        let jumped: Vec<_> = (0..100)
            .map(|i| {
                let mut pose = noise.around(&truth);
                pose.translation.vector.z += if i < 60 { 0.0 } else { 0.03 };
                pose
            })
            .collect();
        assert!(matches!(average_pose(&jumped), Err(AlignmentError::Scattered { .. })));
        assert_eq!(
            average_pose(&drifting[..9]),
            Err(AlignmentError::TooFew { got: 9, needed: 10 })
        );
    }

    #[test]
    fn equal_records_average_to_themselves() {
        let pose = Isometry3::new(Vector3::new(0.3, 0.1, -0.4), Vector3::new(0.2, 0.1, 0.3));
        let average = average_pose(&[pose; 20]).unwrap();
        assert_eq!((average.used, average.left_out), (20, 0));
        assert!(average.spread_m < 1e-12 && average.spread_rad < 1e-7);
    }
}
