//! Where a ray meets a triangle.

use nalgebra::{Point3, Vector3};

/// Distance along a ray to a triangle, in lengths of `direction`, and the barycentric coordinates of
/// where it is met; `None` where it is not.
///
/// Source: Möller & Trumbore (1997), Journal of Graphics Tools 2(1).
pub fn ray_hit(
    [a, b, c]: &[Point3<f64>; 3],
    origin: &Point3<f64>,
    direction: &Vector3<f64>,
) -> Option<(f64, [f64; 3])> {
    let (side_b, side_c) = (b - a, c - a);
    let normal_c = direction.cross(&side_c);
    let determinant = side_b.dot(&normal_c);
    if determinant.abs() < f64::MIN_POSITIVE {
        return None;
    }
    let from_a = origin - a;
    let v = from_a.dot(&normal_c) / determinant;
    let normal_b = from_a.cross(&side_b);
    let w = direction.dot(&normal_b) / determinant;
    let distance = side_c.dot(&normal_b) / determinant;
    // A ray through an edge belongs to both sides rather than to neither.
    let is_inside = v >= -EDGE_SLACK && w >= -EDGE_SLACK && v + w <= 1.0 + EDGE_SLACK;
    (is_inside && distance > 0.0).then_some((distance, [1.0 - v - w, v, w]))
}

/// Barycentric coordinates below 0 that still count: a ray through an edge meets both sides.
const EDGE_SLACK: f64 = 1e-9;

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn ray_aimed_into_a_triangle_meets_it_there(
            corners in prop::array::uniform3(prop::array::uniform3(-1.0..1.0f64)),
            weights in prop::array::uniform3(0.05..1.0f64),
            from in prop::array::uniform3(2.0..3.0f64),
        ) {
            let corners = corners.map(Point3::from);
            let sum: f64 = weights.iter().sum();
            let inside = (0..3).fold(Vector3::zeros(), |p, i| p + corners[i].coords * (weights[i] / sum));
            let area = (corners[1] - corners[0]).cross(&(corners[2] - corners[0])).norm();
            let origin = Point3::from(from);
            let way = Point3::from(inside) - origin;
            let across = (corners[1] - corners[0]).cross(&(corners[2] - corners[0])).dot(&way).abs();
            prop_assume!(area > 1e-2 && across > 1e-2);
            let (met, _) = ray_hit(&corners, &origin, &way.normalize()).unwrap();
            prop_assert!((met - way.norm()).abs() < 1e-9);
            prop_assert!(ray_hit(&corners, &origin, &-way.normalize()).is_none());
        }
    }
}
