//! What triangles far away look like: their share of the winding number from sums over the group.

use nalgebra::{Matrix3, Point3, Vector3};

/// Sums over a group of triangles from which its solid angle is taken where the group is far away.
///
/// The kernel r / |r|³ is expanded about `centre` to second order, so with a distance of twice the
/// radius the error of one group is a few hundredths of its own solid angle at most.
/// Source: Barill, Dickson, Schmidt, Levin and Jacobson, "Fast winding numbers for soups and
/// clouds", ACM Transactions on Graphics 37 (2018), equations 11 to 16.
#[derive(Clone, Debug)]
pub(super) struct Moments {
    /// Mean of the triangles' places by area.
    pub(super) centre: Point3<f64>,
    /// Largest distance of a corner from the centre.
    pub(super) radius: f64,
    /// Sum of area times normal.
    area: Vector3<f64>,
    /// ∫ n (x − c)ᵀ.
    first: Matrix3<f64>,
    /// ∫ nᵢ (x − c)ⱼ (x − c)ₖ, by i.
    second: [Matrix3<f64>; 3],
}

impl Moments {
    /// Sums over triangles.
    pub(super) fn of(triangles: &[[Point3<f64>; 3]]) -> Self {
        let centre = centre_of(triangles);
        let mut moments = Self {
            centre,
            radius: 0.0,
            area: Vector3::zeros(),
            first: Matrix3::zeros(),
            second: [Matrix3::zeros(); 3],
        };
        for corners in triangles {
            let [a, b, c] = corners.map(|p| p - centre);
            for corner in [a, b, c] {
                moments.radius = moments.radius.max(corner.norm());
            }
            let normal = (b - a).cross(&(c - a)) * 0.5;
            let sum = a + b + c;
            let spread = a * a.transpose() + b * b.transpose() + c * c.transpose();
            let square = (spread + sum * sum.transpose()) / 12.0;
            moments.area += normal;
            moments.first += normal * (sum / 3.0).transpose();
            for i in 0..3 {
                moments.second[i] += square * normal[i];
            }
        }
        moments
    }

    /// Share of the winding number at a point that is farther from the centre than the radius.
    pub(super) fn winding(&self, point: &Point3<f64>) -> f64 {
        let r = self.centre - point;
        let square = r.norm_squared();
        let cube = square * square.sqrt();
        let fifth = cube * square;
        let zeroth = self.area.dot(&r) / cube;
        let first = self.first.trace() / cube - 3.0 * r.dot(&(self.first * r)) / fifth;
        let mut row = Vector3::zeros();
        let mut trace = Vector3::zeros();
        let mut cubic = 0.0;
        for i in 0..3 {
            row += self.second[i].row(i).transpose();
            trace[i] = self.second[i].trace();
            cubic += r[i] * r.dot(&(self.second[i] * r));
        }
        let second = -1.5 * (2.0 * row + trace).dot(&r) / fifth + 7.5 * cubic / (fifth * square);
        (zeroth + first + second) / (4.0 * std::f64::consts::PI)
    }
}

/// Mean of the triangles' middles, by area; of the corners where nothing has an area.
fn centre_of(triangles: &[[Point3<f64>; 3]]) -> Point3<f64> {
    let (mut weight, mut sum) = (0.0, Vector3::zeros());
    for [a, b, c] in triangles {
        let area = (b - a).cross(&(c - a)).norm();
        weight += area;
        sum += (a.coords + b.coords + c.coords) * (area / 3.0);
    }
    if weight > 0.0 {
        return Point3::from(sum / weight);
    }
    let corners = triangles.iter().flatten();
    Point3::from(
        corners.map(|p| p.coords).sum::<Vector3<f64>>() / (3 * triangles.len().max(1)) as f64,
    )
}

/// Share of the winding number of one triangle: its signed solid angle over 4π.
///
/// Source: Van Oosterom and Strackee, "The solid angle of a plane triangle", IEEE Transactions on
/// Biomedical Engineering 30 (1983), equation 8.
pub(super) fn winding_of_triangle(corners: &[Point3<f64>; 3], point: &Point3<f64>) -> f64 {
    let [a, b, c] = corners.map(|p| p - point);
    let (la, lb, lc) = (a.norm(), b.norm(), c.norm());
    let above = a.dot(&b.cross(&c));
    let below = la * lb * lc + a.dot(&b) * lc + b.dot(&c) * la + c.dot(&a) * lb;
    above.atan2(below) / (2.0 * std::f64::consts::PI)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::surface::samples::ball;

    #[test]
    fn expansion_converges_with_the_third_power_of_the_distance() {
        let ball = ball(2, Point3::new(0.3, 0.1, -0.2), 1.0);
        // A cap: closed surfaces give 0 outside whatever the order.
        let cap: Vec<_> = (0..40).map(|t| ball.corners(t)).collect();
        let moments = Moments::of(&cap);
        let off = |distance: f64| {
            let direction = Vector3::new(0.2, 0.9, -0.4).normalize();
            let point = moments.centre + direction * (distance * moments.radius);
            let exact: f64 = cap.iter().map(|t| winding_of_triangle(t, &point)).sum();
            (moments.winding(&point) / exact - 1.0).abs()
        };
        assert!(off(2.0) < 0.06, "{}", off(2.0));
        assert!(off(4.0) < 0.2 * off(2.0) && off(8.0) < 0.2 * off(4.0));
        assert!(off(20.0) < 1e-4, "{}", off(20.0));
    }

    #[test]
    fn triangle_seen_from_its_own_plane_has_no_angle() {
        let [a, b, c] = [Point3::origin(), Point3::new(1.0, 0.0, 0.0), Point3::new(0.0, 1.0, 0.0)];
        assert_eq!(winding_of_triangle(&[a, b, c], &Point3::new(2.0, 2.0, 0.0)), 0.0);
        // From close above, half of everything that is seen.
        let w = winding_of_triangle(&[a, b, c], &Point3::new(0.25, 0.25, -1e-9));
        assert!((w - 0.5).abs() < 1e-6, "{w}");
    }
}
