//! Closest points of triangles, segments and points.

use nalgebra::{Point3, Unit, Vector3};

/// Edges of a triangle, by the positions of their ends.
pub(super) const EDGES: [(usize, usize); 3] = [(0, 1), (1, 2), (2, 0)];

/// Weights of the corners of a triangle that make a point of it; not negative, their sum is one.
pub type Barycentric = [f64; 3];

/// The point of a triangle with some weights.
pub(crate) fn point_at(corners: &[Point3<f64>; 3], weights: &Barycentric) -> Point3<f64> {
    let [a, b, c] = corners.map(|p| p.coords);
    Point3::from(weights[0] * a + weights[1] * b + weights[2] * c)
}

/// The point of a triangle on an edge, at a share of the way from its first corner to its second.
pub(super) fn on_edge((first, second): (usize, usize), share: f64) -> Barycentric {
    let mut weights = [0.0; 3];
    (weights[first], weights[second]) = (1.0 - share, share);
    weights
}

/// The point of a segment that is closest to another point, as a share of the way from `a` to `b`.
pub(super) fn on_segment(a: &Point3<f64>, b: &Point3<f64>, point: &Point3<f64>) -> f64 {
    let along = b - a;
    let square = along.norm_squared();
    if square == 0.0 { 0.0 } else { ((point - a).dot(&along) / square).clamp(0.0, 1.0) }
}

/// The point of a triangle that is closest to another point.
///
/// Source: Ericson, Real-Time Collision Detection (2005), 5.1.5: the region of Voronoi decides.
pub(crate) fn on_triangle(corners: &[Point3<f64>; 3], point: &Point3<f64>) -> Barycentric {
    let [a, b, c] = corners;
    let (ab, ac) = (b - a, c - a);
    let dots = |p: &Point3<f64>| (ab.dot(&(point - p)), ac.dot(&(point - p)));
    let ((d1, d2), (d3, d4), (d5, d6)) = (dots(a), dots(b), dots(c));
    if d1 <= 0.0 && d2 <= 0.0 {
        return [1.0, 0.0, 0.0];
    }
    if d3 >= 0.0 && d4 <= d3 {
        return [0.0, 1.0, 0.0];
    }
    if d6 >= 0.0 && d5 <= d6 {
        return [0.0, 0.0, 1.0];
    }
    let (va, vb, vc) = (d3 * d6 - d5 * d4, d5 * d2 - d1 * d6, d1 * d4 - d3 * d2);
    if vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0 {
        let t = d1 / (d1 - d3);
        return [1.0 - t, t, 0.0];
    }
    if vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0 {
        let t = d2 / (d2 - d6);
        return [1.0 - t, 0.0, t];
    }
    if va <= 0.0 && d4 - d3 >= 0.0 && d5 - d6 >= 0.0 {
        let t = (d4 - d3) / ((d4 - d3) + (d5 - d6));
        return [0.0, 1.0 - t, t];
    }
    let sum = va + vb + vc;
    [va / sum, vb / sum, vc / sum]
}

/// The closest points of two segments, as shares of the way along each.
///
/// Source: Ericson, Real-Time Collision Detection (2005), 5.1.9.
pub(super) fn of_segments(p: [&Point3<f64>; 2], q: [&Point3<f64>; 2]) -> (f64, f64) {
    let (d1, d2, r) = (p[1] - p[0], q[1] - q[0], p[0] - q[0]);
    let (a, e, f) = (d1.norm_squared(), d2.norm_squared(), d2.dot(&r));
    if a == 0.0 || e == 0.0 {
        return match a == 0.0 {
            true => (0.0, on_segment(q[0], q[1], p[0])),
            false => (on_segment(p[0], p[1], q[0]), 0.0),
        };
    }
    let (b, c) = (d1.dot(&d2), d1.dot(&r));
    let denominator = a * e - b * b;
    // Nearly parallel segments are equally far along a stretch: any point of it will do.
    let s = match denominator > 1e-14 * a * e {
        true => ((b * f - c * e) / denominator).clamp(0.0, 1.0),
        false => 0.0,
    };
    let t = (b * s + f) / e;
    match t {
        t if t < 0.0 => ((-c / a).clamp(0.0, 1.0), 0.0),
        t if t > 1.0 => (((b - c) / a).clamp(0.0, 1.0), 1.0),
        t => (s, t),
    }
}

/// The closest points of a triangle and a segment: weights in the triangle, share along the segment.
pub(super) fn of_triangle_and_segment(
    corners: &[Point3<f64>; 3],
    from: &Point3<f64>,
    to: &Point3<f64>,
) -> (Barycentric, f64) {
    if let Some(crossing) = crossing(corners, from, to) {
        return crossing;
    }
    let along = to - from;
    let mut best = (f64::INFINITY, [1.0, 0.0, 0.0], 0.0);
    let mut consider = |weights: Barycentric, t: f64| {
        let apart = (point_at(corners, &weights) - (from + t * along)).norm_squared();
        if apart < best.0 {
            best = (apart, weights, t);
        }
    };
    consider(on_triangle(corners, from), 0.0);
    consider(on_triangle(corners, to), 1.0);
    for (first, second) in EDGES {
        let (s, t) = of_segments([&corners[first], &corners[second]], [from, to]);
        consider(on_edge((first, second), s), t);
    }
    (best.1, best.2)
}

/// Where a segment goes through a triangle.
fn crossing(
    corners: &[Point3<f64>; 3],
    from: &Point3<f64>,
    to: &Point3<f64>,
) -> Option<(Barycentric, f64)> {
    let normal = area_normal(corners);
    let (above, below) = (normal.dot(&(from - corners[0])), normal.dot(&(to - corners[0])));
    if above * below > 0.0 || above == below {
        return None;
    }
    let t = above / (above - below);
    let point = from + t * (to - from);
    let square = normal.norm_squared();
    let share = |a: usize, b: usize| {
        normal.dot(&(corners[a] - point).cross(&(corners[b] - point))) / square
    };
    let weights = [share(1, 2), share(2, 0), share(0, 1)];
    weights.iter().all(|w| *w >= 0.0).then_some((weights, t))
}

/// The point of a triangle that is closest to another triangle, and the square of the distance there; where
/// they cross, a point at which an edge of one goes through the other.
///
/// Units: m².
pub(super) fn on_triangle_to_triangle(
    corners: &[Point3<f64>; 3],
    other: &[Point3<f64>; 3],
) -> (Barycentric, f64) {
    let mut best = ([1.0, 0.0, 0.0], f64::INFINITY);
    let mut consider = |weights: Barycentric, place: Point3<f64>| {
        let square = (point_at(corners, &weights) - place).norm_squared();
        if square < best.1 {
            best = (weights, square);
        }
    };
    // Corners first: of several nearest points one at a corner counts.
    for (k, corner) in corners.iter().enumerate() {
        consider(on_edge((k, (k + 1) % 3), 0.0), point_at(other, &on_triangle(other, corner)));
    }
    other.iter().for_each(|corner| consider(on_triangle(corners, corner), *corner));
    for (a, b) in EDGES {
        let (from, to) = (&corners[a], &corners[b]);
        for (c, d) in EDGES {
            let (s, t) = of_segments([from, to], [&other[c], &other[d]]);
            consider(on_edge((a, b), s), other[c] + t * (other[d] - other[c]));
        }
        if let Some((_, t)) = crossing(other, from, to) {
            return (on_edge((a, b), t), 0.0);
        }
        if let Some((weights, _)) = crossing(corners, &other[a], &other[b]) {
            return (weights, 0.0);
        }
    }
    best
}

/// Twice the area of a triangle along its normal; outward where the corners are counter-clockwise
/// seen from outside.
pub(crate) fn area_normal(corners: &[Point3<f64>; 3]) -> Vector3<f64> {
    (corners[1] - corners[0]).cross(&(corners[2] - corners[0]))
}

/// Distance of a point from a body's surface, and the way out of the body.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SignedDistance {
    /// Positive outside, negative inside, m.
    pub distance: f64,
    /// The direction in which the distance grows: out of the body.
    pub normal: Unit<Vector3<f64>>,
}

/// A point of a triangle and its distance from a body.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Deepest {
    /// Weights of the corners.
    pub weights: Barycentric,
    /// Signed distance, and the way out of the body.
    pub distance: SignedDistance,
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn point() -> impl Strategy<Value = Point3<f64>> {
        prop::array::uniform3(-1.0..1.0f64).prop_map(Point3::from)
    }

    /// Weights on a fine lattice over the triangle.
    fn lattice() -> impl Iterator<Item = Barycentric> {
        let n = 24;
        (0..=n).flat_map(move |i| {
            (0..=n - i).map(move |j| {
                let (a, b) = (f64::from(i) / f64::from(n), f64::from(j) / f64::from(n));
                [a, b, 1.0 - a - b]
            })
        })
    }

    proptest! {
        #[test]
        fn no_point_of_the_triangle_is_closer(
            corners in prop::array::uniform3(point()), p in point(),
        ) {
            let found = (point_at(&corners, &on_triangle(&corners, &p)) - p).norm();
            for weights in lattice() {
                prop_assert!(found <= (point_at(&corners, &weights) - p).norm() + 1e-12);
            }
        }

        #[test]
        fn no_points_of_two_triangles_are_closer(
            corners in prop::array::uniform3(point()), other in prop::array::uniform3(point()),
        ) {
            let (weights, square) = on_triangle_to_triangle(&corners, &other);
            let place = point_at(&corners, &weights);
            let there = (point_at(&other, &on_triangle(&other, &place)) - place).norm();
            prop_assert!((there - square.sqrt()).abs() < 1e-9, "{there} {}", square.sqrt());
            for weights in lattice() {
                let place = point_at(&corners, &weights);
                let other = point_at(&other, &on_triangle(&other, &place));
                prop_assert!(square.sqrt() <= (place - other).norm() + 1e-9);
            }
        }

        #[test]
        fn no_points_of_triangle_and_segment_are_closer(
            corners in prop::array::uniform3(point()), from in point(), to in point(),
        ) {
            let (weights, t) = of_triangle_and_segment(&corners, &from, &to);
            prop_assert!(weights.iter().all(|w| (-1e-12..=1.0 + 1e-12).contains(w)));
            let found = (point_at(&corners, &weights) - (from + t * (to - from))).norm();
            for weights in lattice() {
                for step in 0..=20 {
                    let on = from + f64::from(step) / 20.0 * (to - from);
                    prop_assert!(found <= (point_at(&corners, &weights) - on).norm() + 1e-9);
                }
            }
        }
    }
}
