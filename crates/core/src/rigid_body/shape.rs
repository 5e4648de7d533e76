//! The shape of a rigid body, the signed distance of points from it, and the point of a triangle that
//! is deepest in it, or nearest to it.

use std::sync::Arc;

use nalgebra::{Matrix3, Point3, Unit, Vector3};

use super::closest::{
    Barycentric, Deepest, SignedDistance, area_normal, of_triangle_and_segment, on_triangle,
    point_at,
};
use super::triangles::RigidMesh;

/// A rigid body in a frame of its own.
///
/// Units: m. Frame: the body's.
#[derive(Clone, Debug)]
pub enum RigidShape {
    /// A ball around the origin.
    Sphere {
        /// Radius of the ball.
        radius: f64,
    },
    /// All points within a radius of a segment along z, centred at the origin.
    Capsule {
        /// Distance of the surface from the segment.
        radius: f64,
        /// Length of the segment, between the centres of the two half balls.
        length: f64,
    },
    /// The half space below a plane through the origin.
    Plane {
        /// Out of the half space.
        normal: Unit<Vector3<f64>>,
    },
    /// A box around the origin.
    Cuboid {
        /// Half its edges along x, y and z.
        half: Vector3<f64>,
    },
    /// The inside of a closed surface.
    Mesh(Arc<RigidMesh>),
}

/// Steps of a search by thirds: each takes a third of the stretch away.
const THIRDS: usize = 60;

/// A size that makes no body.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ShapeError {
    /// A size that is no positive number.
    #[error("{what} is {value}; it must be a positive number of metres")]
    Size {
        /// Name of the size.
        what: &'static str,
        /// What it is.
        value: f64,
    },
    /// A normal without a direction.
    #[error("the normal of a plane must have a direction")]
    Normal,
}

impl RigidShape {
    /// A sphere.
    ///
    /// # Errors
    /// [`ShapeError::Size`].
    pub fn sphere(radius: f64) -> Result<Self, ShapeError> {
        Ok(Self::Sphere { radius: positive("radius", radius)? })
    }

    /// A capsule along z.
    ///
    /// # Errors
    /// [`ShapeError::Size`].
    pub fn capsule(radius: f64, length: f64) -> Result<Self, ShapeError> {
        let (radius, length) = (positive("radius", radius)?, positive("length", length)?);
        Ok(Self::Capsule { radius, length })
    }

    /// A half space.
    ///
    /// # Errors
    /// [`ShapeError::Normal`].
    pub fn plane(normal: Vector3<f64>) -> Result<Self, ShapeError> {
        let is_finite = normal.iter().all(|x| x.is_finite());
        let unit = Unit::try_new(normal, f64::MIN_POSITIVE).filter(|_| is_finite);
        Ok(Self::Plane { normal: unit.ok_or(ShapeError::Normal)? })
    }

    /// A box.
    ///
    /// # Errors
    /// [`ShapeError::Size`].
    pub fn cuboid(half: Vector3<f64>) -> Result<Self, ShapeError> {
        for value in half.iter() {
            positive("half an edge", *value)?;
        }
        Ok(Self::Cuboid { half })
    }

    /// Signed distance of a point and the way out.
    ///
    /// Units: m. Frame: the body's.
    pub fn distance(&self, point: &Point3<f64>) -> SignedDistance {
        match self {
            Self::Sphere { radius } => of_axis(point.coords, *radius),
            Self::Capsule { radius, length } => {
                let along = point.z.clamp(-0.5 * length, 0.5 * length);
                of_axis(point.coords - Vector3::new(0.0, 0.0, along), *radius)
            }
            Self::Plane { normal } => {
                SignedDistance { distance: point.coords.dot(normal), normal: *normal }
            }
            Self::Cuboid { half } => of_cuboid(point, half),
            Self::Mesh(mesh) => mesh.distance(point),
        }
    }

    /// Curvature of a round body's surface, seen from a point: the Hessian of the distance. `None` where it
    /// is flat or has edges.
    ///
    /// Units: 1/m. Frame: the body's.
    pub fn curvature(&self, point: &Point3<f64>) -> Option<Matrix3<f64>> {
        let (from_axis, straight) = match self {
            Self::Sphere { .. } => (point.coords, Matrix3::zeros()),
            Self::Capsule { length, .. } => {
                let along = point.z.clamp(-0.5 * length, 0.5 * length);
                let axis = Vector3::z() * f64::from(along == point.z);
                (point.coords - along * Vector3::z(), axis * axis.transpose())
            }
            Self::Plane { .. } | Self::Cuboid { .. } | Self::Mesh(_) => return None,
        };
        let radius = from_axis.norm();
        let normal = from_axis.try_normalize(f64::MIN_POSITIVE)?;
        Some((Matrix3::identity() - normal * normal.transpose() - straight) / radius)
    }

    /// Whether every triangle has one deepest point in it that moves smoothly with the triangle: a
    /// round body.
    pub fn is_round(&self) -> bool {
        matches!(self, Self::Sphere { .. } | Self::Capsule { .. })
    }

    /// Half of the smallest width of the body: a surface that moves by less in one step cannot be
    /// found on the far side. Infinite for a half space.
    ///
    /// Units: m.
    pub fn thickness(&self) -> f64 {
        match self {
            Self::Sphere { radius } | Self::Capsule { radius, .. } => *radius,
            Self::Plane { .. } => f64::INFINITY,
            Self::Cuboid { half } => half.min(),
            Self::Mesh(mesh) => mesh.thickness(),
        }
    }

    /// Radius of a ball around the origin that holds the body; infinite for a half space.
    ///
    /// Units: m.
    pub fn reach(&self) -> f64 {
        match self {
            Self::Sphere { radius } => *radius,
            Self::Capsule { radius, length } => radius + 0.5 * length,
            Self::Plane { .. } => f64::INFINITY,
            Self::Cuboid { half } => half.norm(),
            Self::Mesh(mesh) => mesh.reach(),
        }
    }

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
    fn deepest_of_convex(&self, corners: &[Point3<f64>; 3]) -> Deepest {
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

fn positive(what: &'static str, value: f64) -> Result<f64, ShapeError> {
    match value > 0.0 && value.is_finite() {
        true => Ok(value),
        false => Err(ShapeError::Size { what, value }),
    }
}

/// Distance from a round body, by the way from its axis.
fn of_axis(from_axis: Vector3<f64>, radius: f64) -> SignedDistance {
    let distance = from_axis.norm() - radius;
    // On the axis every way out is equally long.
    let normal = Unit::try_new(from_axis, f64::MIN_POSITIVE).unwrap_or(Vector3::x_axis());
    SignedDistance { distance, normal }
}

fn of_cuboid(point: &Point3<f64>, half: &Vector3<f64>) -> SignedDistance {
    let outside = point.coords.zip_map(half, |x, h| x - x.clamp(-h, h));
    if let Some((normal, distance)) = Unit::try_new_and_get(outside, 0.0) {
        return SignedDistance { distance, normal };
    }
    let depth = point.coords.zip_map(half, |x, h| x.abs() - h);
    let axis = depth.imax();
    let sign = if point.coords[axis] < 0.0 { -1.0 } else { 1.0 };
    let mut normal = Vector3::zeros();
    normal[axis] = sign;
    SignedDistance { distance: depth[axis], normal: Unit::new_unchecked(normal) }
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

    fn shapes() -> Vec<RigidShape> {
        vec![
            RigidShape::sphere(0.3).unwrap(),
            RigidShape::capsule(0.2, 0.5).unwrap(),
            RigidShape::plane(Vector3::new(0.3, -0.2, 0.9)).unwrap(),
            RigidShape::cuboid(Vector3::new(0.2, 0.4, 0.1)).unwrap(),
        ]
    }

    proptest! {
        #[test]
        fn normal_is_where_the_distance_grows_at_rate_one(
            p in prop::array::uniform3(-1.0..1.0f64),
        ) {
            for shape in shapes() {
                let p = Point3::from(p);
                let here = shape.distance(&p);
                // Across the middle of a box the nearest face changes.
                if here.distance <= -0.05 {
                    continue;
                }
                let h = 1e-7;
                let there = shape.distance(&(p + h * here.normal.into_inner()));
                prop_assert!(((there.distance - here.distance) / h - 1.0).abs() < 1e-6);
            }
        }
    }

    #[test]
    fn sizes_that_make_no_body_are_refused() {
        assert!(RigidShape::sphere(0.0).is_err());
        assert!(RigidShape::capsule(0.1, f64::NAN).is_err());
        assert!(RigidShape::plane(Vector3::zeros()).is_err());
        assert!(RigidShape::plane(Vector3::new(f64::INFINITY, 0.0, 0.0)).is_err());
        assert!(RigidShape::cuboid(Vector3::new(0.1, -0.1, 0.1)).is_err());
    }

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
