//! The point about which a receiver turned: pivot calibration.

use nalgebra::{Isometry3, Matrix3, Point3, SymmetricEigen, Vector3};

use super::average::{FLOOR_M, OUTLIER_MEDIANS, median, sound};
use super::error::AlignmentError;

/// The point that stayed where it was while the receiver turned about it.
///
/// Units: m.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pivot {
    /// The point in the receiver frame.
    pub in_receiver: Point3<f64>,
    /// The point in the frame of the poses.
    pub in_stand: Point3<f64>,
    /// Root mean square distance of the point from `in_stand` over the poses that were used.
    pub residual_m: f64,
    /// Standard deviation of `in_receiver` in the least certain direction, from the residual.
    pub uncertainty_m: f64,
    /// Standard deviation of the receiver's turns in the weakest direction, rad.
    pub turned_rad: f64,
    /// Number of poses that were used.
    pub used: usize,
    /// Number of poses that were left out.
    pub left_out: usize,
}

/// Fewest poses from which the point is found.
const NEEDED: usize = 20;
/// Turns needed in the weakest direction: a sweep of 15° to either side.
const MIN_TURN_RAD: f64 = 0.15;
/// Largest root mean square distance of the point from its mean position, m.
const MAX_RESIDUAL_M: f64 = 5e-3;

/// Finds the fixed point p of the poses (R, t), the least squares solution of R p + t = q.
///
/// Poses whose point is farther than three median deviations from the others are left out once.
///
/// # Errors
/// [`AlignmentError`] for fewer than 20 poses, turns that leave a direction of p open, a point
/// that moved by more than 5 mm, or more than a fifth of the poses left out.
pub fn find_pivot(stand_from_receiver: &[Isometry3<f64>]) -> Result<Pivot, AlignmentError> {
    let poses = sound(stand_from_receiver);
    let first = solve(&poses)?;
    let ways: Vec<f64> = poses.iter().map(|pose| first.way(pose)).collect();
    let most = (OUTLIER_MEDIANS * median(ways.clone())).max(FLOOR_M);
    let near: Vec<Isometry3<f64>> =
        poses.iter().zip(&ways).filter(|(_, way)| **way <= most).map(|(pose, _)| *pose).collect();
    let left_out = poses.len() - near.len();
    if 5 * left_out > poses.len() {
        return Err(AlignmentError::Scattered { left_out, of: poses.len() });
    }
    let found = solve(&near)?;
    let squares: f64 = near.iter().map(|pose| found.way(pose).powi(2)).sum();
    let residual_m = (squares / near.len() as f64).sqrt();
    if residual_m > MAX_RESIDUAL_M {
        return Err(AlignmentError::CreaseMoved { residual_m });
    }
    let along_one_axis = residual_m / 3.0f64.sqrt();
    Ok(Pivot {
        in_receiver: found.in_receiver,
        in_stand: found.in_stand,
        residual_m,
        uncertainty_m: along_one_axis / ((near.len() as f64).sqrt() * found.turned_rad),
        turned_rad: found.turned_rad,
        used: near.len(),
        left_out,
    })
}

/// The fixed point by least squares, in the receiver frame and in the frame of the poses.
struct Solution {
    in_receiver: Point3<f64>,
    in_stand: Point3<f64>,
    turned_rad: f64,
}

impl Solution {
    /// Distance of the point, as one pose has it, from its position in the frame of the poses, m.
    fn way(&self, pose: &Isometry3<f64>) -> f64 {
        (pose * self.in_receiver - self.in_stand).norm()
    }
}

fn solve(poses: &[Isometry3<f64>]) -> Result<Solution, AlignmentError> {
    if poses.len() < NEEDED {
        return Err(AlignmentError::TooFew { got: poses.len(), needed: NEEDED });
    }
    let share = 1.0 / poses.len() as f64;
    let rotation = |pose: &Isometry3<f64>| pose.rotation.to_rotation_matrix().into_inner();
    let mean_rotation: Matrix3<f64> = poses.iter().map(rotation).sum::<Matrix3<f64>>() * share;
    let mean_place: Vector3<f64> =
        poses.iter().map(|pose| pose.translation.vector).sum::<Vector3<f64>>() * share;
    // q follows from p, so only p is solved for, of the differences from the means.
    let (mut normal, mut right) = (Matrix3::zeros(), Vector3::zeros());
    for pose in poses {
        let turn = rotation(pose) - mean_rotation;
        normal += turn.transpose() * turn * share;
        right -= turn.transpose() * (pose.translation.vector - mean_place) * share;
    }
    let eigen = SymmetricEigen::new(normal);
    let turned_rad = eigen.eigenvalues.min().max(0.0).sqrt();
    if turned_rad < MIN_TURN_RAD {
        return Err(AlignmentError::TurnedTooLittle { turned_rad, needed_rad: MIN_TURN_RAD });
    }
    let in_basis = eigen.eigenvectors.transpose() * right;
    let point = eigen.eigenvectors * in_basis.component_div(&eigen.eigenvalues);
    Ok(Solution {
        in_receiver: point.into(),
        in_stand: (mean_rotation * point + mean_place).into(),
        turned_rad,
    })
}

#[cfg(test)]
mod tests {
    use super::super::synthetic::{Noise, turning_about};
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn fixed_point_is_found_through_the_noise_of_a_tracker(
            crease in prop::array::uniform3(-0.08..0.08f64),
            place in prop::array::uniform3(-0.5..0.5f64),
            seed in any::<u64>(),
        ) {
            let mut noise = Noise::new(seed);
            let (crease, place) = (Point3::from(crease), Point3::from(place));
            let poses = turning_about(crease, place, 60, 0.35, &mut noise);
            let pivot = find_pivot(&poses).unwrap();
            let off = (pivot.in_receiver - crease).norm();
            // 0.8 mm over 60 poses of some 16° in the weak direction: 0.4 mm, here eight of it.
            prop_assert!(off < 3e-3, "{off}");
            prop_assert!(off < 6.0 * pivot.uncertainty_m + 2e-4, "{off} {}", pivot.uncertainty_m);
            prop_assert!((pivot.in_stand - place).norm() < 3e-3);
            prop_assert!((5e-4..2e-3).contains(&pivot.residual_m), "{}", pivot.residual_m);
        }

        #[test]
        fn without_noise_the_point_is_exact(
            crease in prop::array::uniform3(-0.08..0.08f64), seed in any::<u64>(),
        ) {
            let place = Point3::new(0.2, -0.1, 0.4);
            let mut noise = Noise::none(seed);
            let poses = turning_about(Point3::from(crease), place, 20, 0.5, &mut noise);
            let pivot = find_pivot(&poses).unwrap();
            prop_assert!((pivot.in_receiver - Point3::from(crease)).norm() < 1e-10);
            prop_assert!((pivot.in_stand - place).norm() < 1e-10);
        }
    }

    #[test]
    fn wild_poses_are_left_out() {
        let mut noise = Noise::new(5);
        let (crease, place) = (Point3::new(0.04, 0.0, 0.03), Point3::new(0.0, -0.2, -0.5));
        let mut poses = turning_about(crease, place, 80, 0.4, &mut noise);
        for pose in poses.iter_mut().step_by(16) {
            pose.translation.vector *= -1.0;
        }
        poses[1].translation.vector.x = f64::NAN;
        let pivot = find_pivot(&poses).unwrap();
        assert!((5..9).contains(&pivot.left_out), "{}", pivot.left_out);
        assert!((pivot.in_receiver - crease).norm() < 1.5e-3);
    }

    #[test]
    fn turns_about_one_axis_or_a_moving_crease_are_refused() {
        let mut noise = Noise::new(6);
        let crease = Point3::new(0.04, 0.0, 0.03);
        let hinge: Vec<_> = (0..60)
            .map(|i| {
                let turn = Vector3::new(0.0, 0.02 * f64::from(i - 30), 0.0);
                let turned = Isometry3::new(Vector3::zeros(), turn);
                let shift = -(turned * crease).coords;
                noise.around(&Isometry3::from_parts(shift.into(), turned.rotation))
            })
            .collect();
        let error = find_pivot(&hinge).unwrap_err();
        assert!(matches!(error, AlignmentError::TurnedTooLittle { .. }), "{error}");
        let place = Point3::new(0.0, -0.2, -0.5);
        let mut sliding = turning_about(crease, place, 60, 0.4, &mut noise);
        for (i, pose) in sliding.iter_mut().enumerate() {
            pose.translation.vector.z += 0.04 * i as f64 / 60.0;
        }
        let error = find_pivot(&sliding).unwrap_err();
        assert!(matches!(error, AlignmentError::CreaseMoved { .. }), "{error}");
        assert!(matches!(find_pivot(&sliding[..19]), Err(AlignmentError::TooFew { .. })));
    }
}
