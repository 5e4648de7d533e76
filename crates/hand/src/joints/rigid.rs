//! The rigid motion that brings points nearest to their counterparts.

use nalgebra::{Isometry3, Matrix3, Point3, Rotation3, Translation3, UnitQuaternion, Vector3};

/// A point, the place where it is seen, and the weight of their distance.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Pair {
    /// The point in the moved frame, m.
    pub(super) from: Point3<f64>,
    /// The place where it is seen, in the fixed frame, m.
    pub(super) to: Point3<f64>,
    /// Weight of the squared distance, positive.
    pub(super) weight: f64,
}

/// Turns of the singular value decomposition, far more than a 3 × 3 matrix needs.
const TURNS_MAX: usize = 200;

/// The motion with the least weighted sum of squared distances between `motion * from` and `to`.
///
/// `None` without points, and when the decomposition does not end.
///
/// Source: Kabsch 1976 (doi 10.1107/S0567739476001873), by a singular value decomposition.
pub(super) fn rigid_fit(pairs: &[Pair]) -> Option<Isometry3<f64>> {
    let (from_mean, to_mean) = means(pairs)?;
    let mut covariance = Matrix3::zeros();
    for pair in pairs {
        covariance += (pair.to - to_mean) * (pair.from - from_mean).transpose() * pair.weight;
    }
    let svd = covariance.try_svd(true, true, f64::EPSILON, TURNS_MAX)?;
    let (u, v_t) = (svd.u?, svd.v_t?);
    // Of the two orthogonal matrices the one that does not mirror.
    let sign = (u * v_t).determinant().signum();
    let turn = u * Matrix3::from_diagonal(&Vector3::new(1.0, 1.0, sign)) * v_t;
    let rotation = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(turn));
    let rotation = UnitQuaternion::new_normalize(rotation.into_inner());
    let shift = to_mean - rotation * from_mean;
    Some(Isometry3::from_parts(Translation3::from(shift), rotation))
}

/// How far points spread beside the straight line that fits them best, m: the second singular value
/// of their offsets from their mean. Zero for fewer than three points.
pub(super) fn spread_beside_a_line(points: &[Point3<f64>]) -> f64 {
    if points.len() < 3 {
        return 0.0;
    }
    let sum: Vector3<f64> = points.iter().map(|p| p.coords).sum();
    let mean = sum / points.len() as f64;
    let mut moments = Matrix3::zeros();
    for point in points {
        let offset = point.coords - mean;
        moments += offset * offset.transpose();
    }
    let mut values: [f64; 3] = moments.symmetric_eigenvalues().into();
    values.sort_by(f64::total_cmp);
    values[1].max(0.0).sqrt()
}

fn means(pairs: &[Pair]) -> Option<(Point3<f64>, Point3<f64>)> {
    let weight: f64 = pairs.iter().map(|pair| pair.weight).sum();
    if weight.is_nan() || weight <= 0.0 {
        return None;
    }
    let mean = |point: fn(&Pair) -> Point3<f64>| {
        let sum: Vector3<f64> = pairs.iter().map(|pair| point(pair).coords * pair.weight).sum();
        Point3::from(sum / weight)
    };
    Some((mean(|pair| pair.from), mean(|pair| pair.to)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn any_point() -> impl Strategy<Value = Point3<f64>> {
        prop::array::uniform3(-0.2..0.2f64).prop_map(Point3::from)
    }

    fn distance(motion: &Isometry3<f64>, pairs: &[Pair]) -> f64 {
        pairs.iter().map(|p| p.weight * (motion * p.from - p.to).norm_squared()).sum()
    }

    proptest! {
        #[test]
        fn a_motion_comes_back_from_what_it_moved(
            points in prop::collection::vec(any_point(), 4..8),
            shift in prop::array::uniform3(-2.0..2.0f64),
            turn in prop::array::uniform3(-2.0..2.0f64),
        ) {
            prop_assume!(spread_beside_a_line(&points) > 0.02);
            let motion = Isometry3::new(shift.into(), turn.into());
            let pairs: Vec<Pair> = points
                .iter()
                .map(|&from| Pair { from, to: motion * from, weight: 1.0 })
                .collect();
            let found = rigid_fit(&pairs).unwrap();
            prop_assert!((found.translation.vector - motion.translation.vector).norm() < 1e-9);
            prop_assert!(found.rotation.angle_to(&motion.rotation) < 1e-6);
        }

        #[test]
        fn no_small_motion_makes_the_fit_better(
            points in prop::collection::vec((any_point(), any_point(), 0.1..2.0f64), 3..8),
            shift in prop::array::uniform3(-1e-3..1e-3f64),
            turn in prop::array::uniform3(-1e-2..1e-2f64),
        ) {
            let pairs: Vec<Pair> =
                points.into_iter().map(|(from, to, weight)| Pair { from, to, weight }).collect();
            let best = rigid_fit(&pairs).unwrap();
            let other = Isometry3::new(shift.into(), turn.into()) * best;
            prop_assert!(distance(&best, &pairs) <= distance(&other, &pairs) + 1e-12);
        }
    }

    #[test]
    fn a_mirror_image_is_turned_and_never_mirrored() {
        let corners = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [0.0, 0.0, 0.0]];
        let pairs = corners.map(|[x, y, z]| Pair {
            from: Point3::new(x, y, z),
            to: Point3::new(-x, y, z),
            weight: 1.0,
        });
        let turned = rigid_fit(&pairs).unwrap();
        assert!((turned.rotation.to_rotation_matrix().matrix().determinant() - 1.0).abs() < 1e-12);
    }

    #[test]
    fn points_on_a_line_do_not_spread_beside_it() {
        let line = [0.0, 1.0, 3.0].map(|t| Point3::new(t, 2.0 * t, 1.0 - t));
        assert!(spread_beside_a_line(&line) < 1e-7);
        assert_eq!(spread_beside_a_line(&line[..2]), 0.0);
        let corner = [[0.0, 0.0], [0.06, 0.0], [0.0, 0.03]].map(|[x, y]| Point3::new(x, y, 0.0));
        assert!(spread_beside_a_line(&corner) > 0.02);
        assert!(rigid_fit(&[]).is_none());
    }
}
