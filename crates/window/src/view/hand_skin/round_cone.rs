//! Signed distances of simple bodies and their smooth union.

use nalgebra::Point3;

/// Two balls and the cone that touches both: what a string pulled around them would enclose.
///
/// Units: m.
#[derive(Clone, Copy, Debug)]
pub(super) struct RoundCone {
    /// Centres of the balls.
    pub ends: [Point3<f64>; 2],
    /// Radii of the balls.
    pub radii: [f64; 2],
}

impl RoundCone {
    /// Signed distance to the body, negative inside.
    pub fn distance(&self, p: &Point3<f64>) -> f64 {
        let [a, b] = self.ends;
        let [ra, rb] = self.radii;
        let axis = b - a;
        let length_2 = axis.norm_squared();
        let from_a = p - a;
        // The nearest ball of the family between the ends is not the one under the point: it is
        // shifted along the axis by the cone's slope.
        let along = from_a.dot(&axis) / length_2;
        let aside = (from_a.norm_squared() - along * along * length_2).max(0.0).sqrt();
        let slope = ((ra - rb) / length_2.sqrt()).clamp(-0.99, 0.99);
        let shift = aside * slope / ((1.0 - slope * slope) * length_2).sqrt();
        let t = (along - shift).clamp(0.0, 1.0);
        (from_a - axis * t).norm() - (ra + (rb - ra) * t)
    }
}

/// A triangle with thickness.
///
/// Units: m.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sheet {
    /// Corners of the triangle.
    pub corners: [Point3<f64>; 3],
    /// Half the thickness of the sheet.
    pub radius: f64,
}

impl Sheet {
    /// Signed distance to the sheet, negative inside.
    pub fn distance(&self, p: &Point3<f64>) -> f64 {
        let [a, b, c] = self.corners;
        let normal = (b - a).cross(&(c - a));
        let over_face = [(a, b), (b, c), (c, a)]
            .iter()
            .all(|(from, to)| (to - from).cross(&normal).dot(&(p - from)) <= 0.0);
        let to_plane = if over_face {
            (p - a).dot(&normal).abs() / normal.norm()
        } else {
            let edges = [(a, b), (b, c), (c, a)];
            edges.iter().map(|(from, to)| to_line(p, from, to)).fold(f64::INFINITY, f64::min)
        };
        to_plane - self.radius
    }
}

/// Distance to the straight line between two points.
pub(super) fn to_line(p: &Point3<f64>, from: &Point3<f64>, to: &Point3<f64>) -> f64 {
    let axis = to - from;
    let t = ((p - from).dot(&axis) / axis.norm_squared()).clamp(0.0, 1.0);
    (p - from - axis * t).norm()
}

/// Union of two bodies with a fillet: equal to the plain minimum where the distances differ by
/// more than `fillet`, and `fillet / 4` deeper where they are equal.
pub(super) fn smooth_union(a: f64, b: f64, fillet: f64) -> f64 {
    let h = (fillet - (a - b).abs()).max(0.0) / fillet;
    a.min(b) - 0.25 * fillet * h * h
}

/// Intersection of two bodies with a rounded edge.
pub(super) fn smooth_intersection(a: f64, b: f64, round: f64) -> f64 {
    -smooth_union(-a, -b, round)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn any_point() -> impl Strategy<Value = Point3<f64>> {
        prop::array::uniform3(-2.0..2.0f64).prop_map(Point3::from)
    }

    proptest! {
        #[test]
        fn round_cone_is_the_union_of_the_balls_between_its_ends(p in any_point()) {
            let cone = RoundCone {
                ends: [Point3::new(0.0, 0.0, 0.0), Point3::new(0.3, 1.0, -0.2)],
                radii: [0.6, 0.25],
            };
            let ball = |t: f64| {
                let centre = cone.ends[0] + (cone.ends[1] - cone.ends[0]) * t;
                (p - centre).norm() - (0.6 + (0.25 - 0.6) * t)
            };
            let nearest = (0..=2000).map(|i| ball(f64::from(i) / 2000.0)).fold(f64::MAX, f64::min);
            prop_assert!((cone.distance(&p) - nearest).abs() < 1e-3);
        }

        #[test]
        fn sheet_is_the_union_of_the_balls_on_its_triangle(p in any_point()) {
            let sheet = Sheet {
                corners: [
                    Point3::new(0.0, 0.0, 0.0), Point3::new(1.0, 0.2, 0.0), Point3::new(0.2, 0.9, 0.4),
                ],
                radius: 0.1,
            };
            let [a, b, c] = sheet.corners;
            let mut nearest = f64::MAX;
            for i in 0..=100 {
                for j in 0..=100 - i {
                    let (u, v) = (f64::from(i) / 100.0, f64::from(j) / 100.0);
                    nearest = nearest.min((p - (a + (b - a) * u + (c - a) * v)).norm());
                }
            }
            prop_assert!((sheet.distance(&p) - (nearest - 0.1)).abs() < 2e-2);
        }

        #[test]
        fn smooth_union_adds_at_most_a_quarter_of_the_fillet(
            a in -1.0..1.0f64, b in -1.0..1.0f64, fillet in 0.01..0.5f64,
        ) {
            let union = smooth_union(a, b, fillet);
            prop_assert!(union <= a.min(b) && union >= a.min(b) - 0.25 * fillet - 1e-12);
        }
    }
}
