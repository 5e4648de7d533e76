//! The shape of a rigid body, the signed distance of points from it, and the point of a triangle that
//! is deepest in it, or nearest to it.

use std::sync::Arc;

use nalgebra::{Matrix3, Point3, Unit, Vector3};

use super::closest::{
    Barycentric, Deepest, SignedDistance, area_normal, of_triangle_and_segment, on_triangle,
    point_at,
};
use super::cuboid::Cuboid;
use super::sizes::{ShapeError, positive};
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
    Cuboid(Cuboid),
    /// The inside of a closed surface.
    Mesh(Arc<RigidMesh>),
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

    /// A box with sharp edges.
    ///
    /// # Errors
    /// [`ShapeError::Size`].
    pub fn cuboid(half: Vector3<f64>) -> Result<Self, ShapeError> {
        Self::rounded_cuboid(half, 0.0)
    }

    /// A box whose edges and corners are rounded within its sizes: all points within the radius of a
    /// smaller box. With a radius its surface has one normal everywhere, which contact needs to converge.
    ///
    /// Units: m.
    ///
    /// # Errors
    /// [`ShapeError::Size`], [`ShapeError::Rounding`].
    pub fn rounded_cuboid(half: Vector3<f64>, radius: f64) -> Result<Self, ShapeError> {
        Ok(Self::Cuboid(Cuboid::try_new(half, radius)?))
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
            Self::Cuboid(cuboid) => cuboid.distance(point),
            Self::Mesh(mesh) => mesh.distance(point),
        }
    }

    /// Curvature of the body's surface where it is nearest to a point: the Hessian of the distance. `None`
    /// where the surface is flat or has a sharp edge.
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
            Self::Cuboid(cuboid) => return cuboid.curvature(point),
            Self::Mesh(mesh) => return mesh.curvature(point),
            Self::Plane { .. } => return None,
        };
        let radius = from_axis.norm();
        let normal = from_axis.try_normalize(f64::MIN_POSITIVE)?;
        Some((Matrix3::identity() - normal * normal.transpose() - straight) / radius)
    }

    /// Half of the smallest width of the body: a surface that moves by less in one step cannot be
    /// found on the far side. Infinite for a half space.
    ///
    /// Units: m.
    pub fn thickness(&self) -> f64 {
        match self {
            Self::Sphere { radius } | Self::Capsule { radius, .. } => *radius,
            Self::Plane { .. } => f64::INFINITY,
            Self::Cuboid(cuboid) => cuboid.thickness(),
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
            Self::Cuboid(cuboid) => cuboid.reach(),
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
            Self::Cuboid(cuboid) => cuboid.deepest(corners),
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
}

/// Distance from a round body, by the way from its axis.
fn of_axis(from_axis: Vector3<f64>, radius: f64) -> SignedDistance {
    let distance = from_axis.norm() - radius;
    // On the axis every way out is equally long.
    let normal = Unit::try_new(from_axis, f64::MIN_POSITIVE).unwrap_or(Vector3::x_axis());
    SignedDistance { distance, normal }
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

    /// Steps of a search by thirds: each takes a third of the stretch away.
    const THIRDS: usize = 60;

    /// The smallest distance over a triangle from any convex body: the distance is a convex function,
    /// so two searches by thirds, one inside the other, find its smallest value.
    fn deepest_of_convex(shape: &RigidShape, corners: &[Point3<f64>; 3]) -> Deepest {
        let at = |weights: Barycentric| shape.distance(&point_at(corners, &weights));
        let weights = |s: f64, t: f64| [1.0 - s, s * (1.0 - t), s * t];
        let across = |s: f64| by_thirds(|t| at(weights(s, t)).distance);
        let s = by_thirds(|s| at(weights(s, across(s))).distance);
        let inside = weights(s, across(s));
        let inside = Deepest { weights: inside, distance: at(inside) };
        // Where the smallest value is at a corner it is found exactly there.
        let corner = shape.deepest_corner(corners);
        let slack = 1e-12 * shape.reach();
        match corner.distance.distance <= inside.distance.distance + slack {
            true => corner,
            false => inside,
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

    fn shapes() -> Vec<RigidShape> {
        vec![
            RigidShape::sphere(0.3).unwrap(),
            RigidShape::capsule(0.2, 0.5).unwrap(),
            RigidShape::plane(Vector3::new(0.3, -0.2, 0.9)).unwrap(),
            RigidShape::cuboid(Vector3::new(0.2, 0.4, 0.1)).unwrap(),
            RigidShape::rounded_cuboid(Vector3::new(0.2, 0.4, 0.1), 0.03).unwrap(),
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
        let half = Vector3::new(0.3, 0.1, 0.2);
        for radius in [-0.01, 0.11, f64::NAN, f64::INFINITY] {
            let told = RigidShape::rounded_cuboid(half, radius).unwrap_err().to_string();
            assert!(told.contains("between 0 and 0.1 m"), "{told}");
        }
        assert!(RigidShape::rounded_cuboid(half, 0.1).is_ok());
    }

    #[test]
    fn box_rounded_by_half_its_edges_is_a_ball() {
        let ball = RigidShape::sphere(0.3).unwrap();
        let cube = RigidShape::rounded_cuboid(Vector3::repeat(0.3), 0.3).unwrap();
        for p in [[0.1, 0.25, -0.4], [0.0, 0.0, 0.5], [-0.02, 0.01, 0.0]].map(Point3::from) {
            let (of_ball, of_cube) = (ball.distance(&p), cube.distance(&p));
            assert!((of_ball.distance - of_cube.distance).abs() < 1e-15);
            assert!((of_ball.normal.into_inner() - of_cube.normal.into_inner()).norm() < 1e-15);
        }
        let on_it = Point3::from(Vector3::new(2.0, -1.0, 2.0) * 0.1);
        let off = ball.curvature(&on_it).unwrap() - cube.curvature(&on_it).unwrap();
        assert!(off.norm() < 1e-13, "{off}");
    }

    #[test]
    fn box_rounded_by_half_of_two_edges_is_a_capsule() {
        let capsule = RigidShape::capsule(0.2, 0.5).unwrap();
        let bar = RigidShape::rounded_cuboid(Vector3::new(0.2, 0.2, 0.45), 0.2).unwrap();
        for p in [[0.1, 0.25, -0.1], [0.0, 0.1, 0.5], [-0.3, 0.2, 0.35]].map(Point3::from) {
            let (of_capsule, of_bar) = (capsule.distance(&p), bar.distance(&p));
            assert!((of_capsule.distance - of_bar.distance).abs() < 1e-15);
            assert!((of_capsule.normal.into_inner() - of_bar.normal.into_inner()).norm() < 1e-15);
        }
    }

    proptest! {
        /// By differences of the normal, on the surface: faces, edges and corners of a box, capsule, ball.
        #[test]
        fn curvature_is_how_the_normal_turns_along_the_surface(
            p in prop::array::uniform3(-0.6..0.6f64),
            way in prop::array::uniform3(-1.0..1.0f64),
        ) {
            let (from, way, h) = (Point3::from(p), Vector3::from(way), 1e-6);
            for shape in shapes() {
                let away = shape.distance(&from);
                // Deep inside, the nearest face changes; a sharp edge has no one normal.
                let is_sharp = matches!(&shape, RigidShape::Cuboid(cuboid) if cuboid.is_sharp());
                if away.distance < -0.02 || is_sharp {
                    continue;
                }
                let on_it = from - away.distance * away.normal.into_inner();
                let normal = |by: f64| shape.distance(&(on_it + by * way)).normal.into_inner();
                let (ahead, behind) = (normal(h) - normal(0.0), normal(0.0) - normal(-h));
                // Between a face and an edge the curvature leaps.
                if (ahead - behind).norm() > 1e-2 * ahead.norm() + 1e-12 {
                    continue;
                }
                let turns = (ahead + behind) / (2.0 * h);
                let told = shape.curvature(&on_it).map_or(Vector3::zeros(), |bend| bend * way);
                let off = (turns - told).norm();
                prop_assert!(off < 1e-3 * (1.0 + told.norm()), "{shape:?} {turns} {told}");
            }
        }
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
                let (closed, searched) = (shape.deepest(&corners), deepest_of_convex(&shape, &corners));
                let off = closed.distance.distance - searched.distance.distance;
                prop_assert!(off.abs() < 1e-8, "{shape:?}: {closed:?} {searched:?}");
                let there = shape.distance(&point_at(&corners, &closed.weights));
                prop_assert!((there.distance - closed.distance.distance).abs() < 1e-12);
            }
        }

        #[test]
        fn deepest_point_in_a_box_is_the_one_that_the_search_finds(
            corners in prop::array::uniform3(prop::array::uniform3(-0.5..0.5f64)),
            radius in prop_oneof![Just(0.0), Just(0.1), 0.0..0.1f64],
        ) {
            deepest_in_a_box(corners.map(Point3::from), radius)?;
        }

        /// Planes, edges and corners that the box has too, and triangles without an area.
        #[test]
        fn deepest_point_in_a_box_is_found_where_the_triangle_is_aligned_with_it(
            corners in prop::array::uniform3(prop::array::uniform3(0..9usize)),
            radius in prop_oneof![Just(0.0), Just(0.1), Just(0.05)],
        ) {
            let places = [-0.5, -0.4, -0.2, -0.1, 0.0, 0.1, 0.2, 0.4, 0.5];
            deepest_in_a_box(corners.map(|c| Point3::from(c.map(|k| places[k]))), radius)?;
        }
    }

    fn deepest_in_a_box(corners: [Point3<f64>; 3], radius: f64) -> Result<(), TestCaseError> {
        let half = Vector3::new(0.2, 0.4, 0.1);
        let shape = RigidShape::rounded_cuboid(half, radius).unwrap();
        let (closed, searched) = (shape.deepest(&corners), deepest_of_convex(&shape, &corners));
        let off = closed.distance.distance - searched.distance.distance;
        prop_assert!(off < 1e-12, "{closed:?} {searched:?}");
        prop_assert!(off > -1e-8, "{closed:?} {searched:?}");
        let there = shape.distance(&point_at(&corners, &closed.weights));
        prop_assert!((there.distance - closed.distance.distance).abs() < 1e-15);
        let sum: f64 = closed.weights.iter().sum();
        prop_assert!((sum - 1.0).abs() < 1e-12 && closed.weights.iter().all(|w| *w >= 0.0));
        Ok(())
    }
}
