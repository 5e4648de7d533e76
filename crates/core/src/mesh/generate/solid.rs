//! The round built-in objects as functions of space, positive inside.

use nalgebra::{Point3, Vector3};

use super::{strawberry, toothpaste};

/// A solid given by its depth function.
///
/// Frame: the object's, centred near the origin, Y up. Units: m.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Solid {
    Sphere,
    Strawberry,
    Toothpaste,
}

impl Solid {
    /// Positive inside, negative outside, 0 on the surface; about the distance to it near by.
    ///
    /// `spacing` is the lattice's: details that it cannot carry are left out or thickened.
    pub(super) fn depth(self, p: &Point3<f64>, spacing: f64) -> f64 {
        match self {
            Self::Sphere => SPHERE_RADIUS - p.coords.norm(),
            Self::Strawberry => strawberry::depth(p, spacing),
            Self::Toothpaste => toothpaste::depth(p, spacing),
        }
    }

    /// Corners of a box around the solid, symmetric to the origin.
    pub(super) fn bounds(self, spacing: f64) -> (Point3<f64>, Point3<f64>) {
        let half = match self {
            Self::Sphere => Vector3::repeat(SPHERE_RADIUS),
            Self::Strawberry => strawberry::half_extent(),
            Self::Toothpaste => toothpaste::half_extent(spacing),
        };
        (Point3::from(-half), Point3::from(half))
    }

    /// Volume (m³) and surface area (m²), of fine meshes where there is no formula; they only
    /// guide the first guess of a lattice.
    pub(super) fn volume_and_area(self) -> (f64, f64) {
        match self {
            Self::Sphere => (1.796e-4, 1.539e-2),
            Self::Strawberry => (6.81e-5, 8.37e-3),
            Self::Toothpaste => (6.97e-5, 1.335e-2),
        }
    }

    /// The point of the surface near `p`, by Newton's method along the gradient.
    ///
    /// `None` when it is not found within a tenth of `spacing`, as at a sharp edge.
    pub(super) fn project(self, p: &Point3<f64>, spacing: f64) -> Option<Point3<f64>> {
        let step = 1e-4 * spacing;
        let mut at = *p;
        for _ in 0..3 {
            let depth = self.depth(&at, spacing);
            let gradient = Vector3::from([0, 1, 2].map(|d| {
                let mut offset = Vector3::zeros();
                offset[d] = step;
                (self.depth(&(at + offset), spacing) - self.depth(&(at - offset), spacing))
                    / (2.0 * step)
            }));
            let slope_squared = gradient.norm_squared();
            if slope_squared < 1e-12 {
                return None;
            }
            at -= gradient * (depth / slope_squared);
        }
        let near = (at - p).norm() < 0.1 * spacing + self.depth(p, spacing).abs();
        (near && self.depth(&at, spacing).abs() < 1e-4 * spacing).then_some(at)
    }
}

/// Half the sphere's diameter of 7 cm.
pub(super) const SPHERE_RADIUS: f64 = 0.035;

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn any_solid() -> impl Strategy<Value = Solid> {
        prop::sample::select(vec![Solid::Sphere, Solid::Strawberry, Solid::Toothpaste])
    }

    proptest! {
        #[test]
        fn nothing_lies_outside_the_bounds(
            solid in any_solid(),
            coords in prop::array::uniform3(-2.0f64..2.0),
            spacing in 0.0005f64..0.04,
        ) {
            let (_, high) = solid.bounds(spacing);
            prop_assume!(coords.iter().any(|c| c.abs() > 1.0));
            let p = Point3::from(high.coords.component_mul(&Vector3::from(coords)));
            prop_assert!(solid.depth(&p, spacing) <= 0.0);
        }

        #[test]
        fn projected_points_lie_on_the_surface(
            solid in any_solid(),
            direction in prop::array::uniform3(-1.0f64..1.0),
        ) {
            let direction = Vector3::from(direction);
            prop_assume!(direction.norm() > 0.1);
            let spacing = 0.004;
            // Walk out from the middle until just outside.
            let step = direction.normalize() * 0.02 * spacing;
            let mut p = Point3::origin();
            while solid.depth(&p, spacing) > 0.0 {
                p += step;
            }
            if let Some(on) = solid.project(&p, spacing) {
                prop_assert!(solid.depth(&on, spacing).abs() < 1e-4 * spacing);
                prop_assert!((on - p).norm() < 0.2 * spacing);
            } else {
                // Only the tube has edges.
                prop_assert_eq!(solid, Solid::Toothpaste);
            }
        }
    }

    #[test]
    fn middle_of_every_solid_is_inside() {
        for solid in [Solid::Sphere, Solid::Strawberry, Solid::Toothpaste] {
            for spacing in [0.0005, 0.002, 0.01, 0.03] {
                assert!(solid.depth(&Point3::origin(), spacing) > 0.005);
            }
        }
    }
}
