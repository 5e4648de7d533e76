//! A box with sharp or rounded edges: signed distance, curvature, and the deepest point of a triangle in it.

use nalgebra::{Matrix3, Point3, Unit, Vector3};

use super::closest::{
    Barycentric, Deepest, EDGES, SignedDistance, area_normal, on_edge, on_triangle, point_at,
};
use super::sizes::{ShapeError, positive};

/// A box around the origin, its edges along the axes: all points within a radius of a smaller box.
///
/// Units: m. Frame: the body's.
#[derive(Clone, Debug, PartialEq)]
pub struct Cuboid {
    /// Half its edges along x, y and z.
    half: Vector3<f64>,
    /// Half the edges of the smaller box.
    inner: Vector3<f64>,
    /// Radius of its rounded edges and corners; 0 where they are sharp.
    radius: f64,
}

/// Share of the size of a box by which a corner of a triangle may be less deep than another point of it and
/// still count as the deepest.
const SLACK: f64 = 1e-12;

impl Cuboid {
    /// Half the edges, above 0, and the radius, at most the smallest of them.
    ///
    /// # Errors
    /// [`ShapeError::Size`], [`ShapeError::Rounding`].
    pub(super) fn try_new(half: Vector3<f64>, radius: f64) -> Result<Self, ShapeError> {
        for value in half.iter() {
            positive("half an edge", *value)?;
        }
        match radius >= 0.0 && radius <= half.min() {
            true => Ok(Self { half, inner: half.add_scalar(-radius), radius }),
            false => Err(ShapeError::Rounding { radius, most: half.min() }),
        }
    }

    /// Half the smallest edge.
    pub(super) fn thickness(&self) -> f64 {
        self.half.min()
    }

    /// Radius of a ball around the origin that holds it.
    pub(super) fn reach(&self) -> f64 {
        self.half.norm()
    }

    /// Whether edges and corners are sharp.
    #[cfg(test)]
    pub(super) fn is_sharp(&self) -> bool {
        self.radius == 0.0
    }

    /// Signed distance of a point and the way out.
    pub(super) fn distance(&self, point: &Point3<f64>) -> SignedDistance {
        let outside = outside_of(point, &self.inner);
        if let Some((normal, distance)) = Unit::try_new_and_get(outside, 0.0) {
            return SignedDistance { distance: distance - self.radius, normal };
        }
        let depth = point.coords.zip_map(&self.inner, |x, h| x.abs() - h);
        let axis = depth.imax();
        let mut normal = Vector3::zeros();
        normal[axis] = if point.coords[axis] < 0.0 { -1.0 } else { 1.0 };
        let normal = Unit::new_unchecked(normal);
        SignedDistance { distance: depth[axis] - self.radius, normal }
    }

    /// Curvature of the surface where it is nearest to a point; `None` on a face, and where edges are sharp.
    ///
    /// Units: 1/m.
    pub(super) fn curvature(&self, point: &Point3<f64>) -> Option<Matrix3<f64>> {
        let outside = outside_of(point, &self.inner);
        let straight = outside.map(|x| f64::from(x == 0.0));
        // Straight along two axes or three: a face.
        if self.radius == 0.0 || straight.sum() > 1.0 {
            return None;
        }
        let normal = outside.try_normalize(f64::MIN_POSITIVE)?;
        let across = Matrix3::identity() - normal * normal.transpose();
        // A point deep in a rounded edge is nearly at its axis, where the distance bends without bound; the
        // surface where it comes out bends by the radius.
        Some((across - Matrix3::from_diagonal(&straight)) / self.radius)
    }

    /// The point of a triangle with the smallest signed distance: the distance is convex, so it is smallest
    /// at one of few points that are known in closed form.
    ///
    /// Shapes: `corners` in any order.
    pub(super) fn deepest(&self, corners: &[Point3<f64>; 3]) -> Deepest {
        let at = |weights: Barycentric| Deepest {
            weights,
            distance: self.distance(&point_at(corners, &weights)),
        };
        let corner = |k: usize| at(std::array::from_fn(|at| f64::from(at == k)));
        let deeper = |a: Deepest, b: Deepest| match b.distance.distance < a.distance.distance {
            true => b,
            false => a,
        };
        let of_corners = deeper(deeper(corner(0), corner(1)), corner(2));

        let mut found = of_corners;
        for (a, b) in EDGES {
            let t = self.nearest_on(&corners[a], &corners[b]);
            found = deeper(found, at(on_edge((a, b), t)));
        }
        let normal = area_normal(corners);
        let height = normal.dot(&corners[0].coords);
        let nearest = self.inner.zip_map(&normal, |h, n| h.copysign(n * height));
        found = deeper(found, at(on_triangle(corners, &Point3::from(nearest))));
        // Where the plane of the triangle cuts the smaller box, the triangle may be inside.
        if height.abs() <= normal.abs().dot(&self.inner) {
            self.ridges(corners, |weights| found = deeper(found, at(weights)));
        }
        // Where the smallest value is at a corner it is found exactly there.
        let slack = SLACK * self.reach();
        match of_corners.distance.distance <= found.distance.distance + slack {
            true => of_corners,
            false => found,
        }
    }

    /// The point of a segment nearest to the smaller box, as a share of the way: the derivative of the squared
    /// distance is linear between the planes of the faces, and never falls.
    fn nearest_on(&self, from: &Point3<f64>, to: &Point3<f64>) -> f64 {
        let along = to - from;
        let slope = |t: f64| outside_of(&(from + t * along), &self.inner).dot(&along);
        let mut shares = [1.0; 7];
        for axis in 0..3 {
            for (side, plane) in [-self.inner[axis], self.inner[axis]].into_iter().enumerate() {
                let t = (plane - from[axis]) / along[axis];
                if t > 0.0 && t < 1.0 {
                    shares[2 * axis + side] = t;
                }
            }
        }
        shares.sort_unstable_by(f64::total_cmp);
        let (mut before, mut falls) = (0.0, slope(0.0));
        if falls >= 0.0 {
            return 0.0;
        }
        for t in shares {
            let now = slope(t);
            if now >= 0.0 {
                return before + (t - before) * falls / (falls - now);
            }
            (before, falls) = (t, now);
        }
        1.0
    }

    /// Points of a triangle at which the distance inside the smaller box, the largest of six linear functions,
    /// can be smallest: where three of them are equal, or two on an edge.
    fn ridges(&self, corners: &[Point3<f64>; 3], mut consider: impl FnMut(Barycentric)) {
        // The functions at the corners; one for each face of the box.
        let faces: [Vector3<f64>; 6] = std::array::from_fn(|face| {
            let (axis, sign) = (face / 2, if face % 2 == 0 { 1.0 } else { -1.0 });
            Vector3::from(corners.map(|corner| sign * corner[axis] - self.inner[axis]))
        });
        for first in 0..6 {
            for second in first + 1..6 {
                let apart = faces[first] - faces[second];
                for (a, b) in EDGES {
                    let t = apart[a] / (apart[a] - apart[b]);
                    if (0.0..=1.0).contains(&t) {
                        consider(on_edge((a, b), t));
                    }
                }
                for third in second + 1..6 {
                    let weights = apart.cross(&(faces[first] - faces[third]));
                    let weights = weights / weights.sum();
                    if weights.iter().all(|w| *w >= 0.0) {
                        consider(weights.into());
                    }
                }
            }
        }
    }
}

/// Way to a point from the nearest one of a box around the origin; zero inside.
fn outside_of(point: &Point3<f64>, half: &Vector3<f64>) -> Vector3<f64> {
    point.coords.zip_map(half, |x, h| x - x.clamp(-h, h))
}
