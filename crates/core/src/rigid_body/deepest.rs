//! The point of a triangle that is deepest in a rigid body, or nearest to it.

use nalgebra::{Point3, Unit, Vector3};

use super::closest::{Barycentric, area_normal, of_triangle_and_segment, on_triangle, point_at};
use super::distance::{Deepest, SignedDistance};
use super::shape::RigidShape;

/// Steps of a search by thirds: each takes a third of the stretch away.
const THIRDS: usize = 60;

impl RigidShape {
    /// The point of a triangle with the smallest signed distance from the body.
    ///
    /// Where a triangle goes through the axis of a round body, the way out of the body is the
    /// triangle's own way in, because the axis tells none.
    ///
    /// Shapes: `corners` counter-clockwise seen from outside of the soft object. Units: m. Frame: the
    /// body's.
    pub fn deepest(&self, corners: &[Point3<f64>; 3]) -> Deepest {
        match self {
            Self::Sphere { radius } => {
                let weights = on_triangle(corners, &Point3::origin());
                round(corners, weights, Point3::origin(), *radius)
            }
            Self::Capsule { radius, length } => {
                let end = Point3::new(0.0, 0.0, 0.5 * length);
                let (weights, t) = of_triangle_and_segment(corners, &-end, &end);
                round(corners, weights, -end + t * (2.0 * end.coords), *radius)
            }
            Self::Plane { .. } => self.deepest_corner(corners),
            Self::Cuboid { .. } => self.deepest_of_convex(corners),
            Self::Mesh(mesh) => mesh.deepest(corners),
        }
    }

    /// The corner with the smallest signed distance.
    fn deepest_corner(&self, corners: &[Point3<f64>; 3]) -> Deepest {
        let mut found: Option<Deepest> = None;
        for (corner, point) in corners.iter().enumerate() {
            let distance = self.distance(point);
            if found.is_none_or(|found| distance.distance < found.distance.distance) {
                let mut weights = [0.0; 3];
                weights[corner] = 1.0;
                found = Some(Deepest { weights, distance });
            }
        }
        found.expect("a triangle has corners")
    }

    /// The smallest distance over a triangle from any convex body: the distance is a convex function,
    /// so two searches by thirds, one inside the other, find its smallest value.
    pub(super) fn deepest_of_convex(&self, corners: &[Point3<f64>; 3]) -> Deepest {
        let at = |weights: Barycentric| self.distance(&point_at(corners, &weights));
        let weights = |s: f64, t: f64| [1.0 - s, s * (1.0 - t), s * t];
        let across = |s: f64| by_thirds(|t| at(weights(s, t)).distance);
        let s = by_thirds(|s| at(weights(s, across(s))).distance);
        let inside = weights(s, across(s));
        let inside = Deepest { weights: inside, distance: at(inside) };
        // Where the smallest value is at a corner it is found exactly there.
        let corner = self.deepest_corner(corners);
        let slack = 1e-12 * self.reach();
        match corner.distance.distance <= inside.distance.distance + slack {
            true => corner,
            false => inside,
        }
    }
}

/// Where a convex function on [0, 1] is smallest.
fn by_thirds(value: impl Fn(f64) -> f64) -> f64 {
    let (mut low, mut high) = (0.0, 1.0);
    for _ in 0..THIRDS {
        let third = (high - low) / 3.0;
        let (a, b) = (low + third, high - third);
        match value(a) <= value(b) {
            true => high = b,
            false => low = a,
        }
    }
    0.5 * (low + high)
}

/// Distance of a triangle's point from a round body whose axis is nearest at `axis`.
fn round(
    corners: &[Point3<f64>; 3],
    weights: Barycentric,
    axis: Point3<f64>,
    radius: f64,
) -> Deepest {
    let from_axis = point_at(corners, &weights) - axis;
    let size = from_axis.norm();
    let distance = match size > 1e-9 * radius {
        true => SignedDistance {
            distance: size - radius,
            normal: Unit::new_unchecked(from_axis / size),
        },
        false => SignedDistance { distance: size - radius, normal: inward(corners) },
    };
    Deepest { weights, distance }
}

/// Into the soft object.
fn inward(corners: &[Point3<f64>; 3]) -> Unit<Vector3<f64>> {
    Unit::try_new(-area_normal(corners), f64::MIN_POSITIVE).unwrap_or(Vector3::x_axis())
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn closed_forms_equal_the_search_over_the_triangle(
            corners in prop::array::uniform3(prop::array::uniform3(-0.5..0.5f64)),
        ) {
            let corners = corners.map(Point3::from);
            let shapes = [
                RigidShape::sphere(0.3).unwrap(),
                RigidShape::capsule(0.2, 0.5).unwrap(),
                RigidShape::plane(Vector3::new(0.3, -0.2, 0.9)).unwrap(),
            ];
            for shape in shapes {
                let (closed, searched) = (shape.deepest(&corners), shape.deepest_of_convex(&corners));
                let off = closed.distance.distance - searched.distance.distance;
                prop_assert!(off.abs() < 1e-8, "{shape:?}: {closed:?} {searched:?}");
                let there = shape.distance(&point_at(&corners, &closed.weights));
                prop_assert!((there.distance - closed.distance.distance).abs() < 1e-12);
            }
        }

        #[test]
        fn no_point_of_the_triangle_is_deeper_in_a_box(
            corners in prop::array::uniform3(prop::array::uniform3(-0.5..0.5f64)),
            at in prop::array::uniform2(0.0..1.0f64),
        ) {
            let corners = corners.map(Point3::from);
            let shape = RigidShape::cuboid(Vector3::new(0.2, 0.4, 0.1)).unwrap();
            let deepest = shape.deepest(&corners).distance.distance;
            let (s, t) = (at[0], at[1]);
            let other = shape.distance(&point_at(&corners, &[1.0 - s, s * (1.0 - t), s * t]));
            prop_assert!(deepest <= other.distance + 1e-9);
        }
    }
}
