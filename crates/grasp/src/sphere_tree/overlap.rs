//! Interference tests between the hand's solids and a sphere (thesis 4.4.2).

use crate::shape::{Cylinder, Sphere};

/// Whether a sphere and a solid finite cylinder have a point in common; exact up to rounding.
///
/// The three cases of the thesis: the sphere's centre lies between the ends (1), beyond one end by
/// at most `r_s` (2, semi-chord `nrad` of (4.9)), or farther (3). Case 2 is exact as it stands: the
/// closest point of the cylinder lies on the end disc, and `d_min ≤ r_c + nrad` is the same as
/// `Δz² + max(0, d_min − r_c)² ≤ r_s²`, also for a centre above the disc itself (`d_min < r_c`).
///
/// Units: any one length. Frame: any one frame. Touching counts; NaN never does.
///
/// Source: thesis (4.7)–(4.9).
#[inline]
pub fn cylinder_meets_sphere(cylinder: &Cylinder, sphere: &Sphere) -> bool {
    let centre = sphere.centre - cylinder.base;
    let s_z = centre.dot(&cylinder.axis);
    let beyond = (s_z - cylinder.length).max(-s_z);
    if beyond > sphere.radius {
        return false;
    }
    let nrad = if beyond > 0.0 {
        (sphere.radius * sphere.radius - beyond * beyond).sqrt()
    } else {
        sphere.radius
    };
    let reach = cylinder.radius + nrad;
    // d_min² as the length of a vector: |centre|² − s_z² would cancel far along the axis.
    (centre - cylinder.axis.into_inner() * s_z).norm_squared() <= reach * reach
}

/// Whether two spheres have a point in common. Touching counts; NaN never does.
///
/// Source: thesis Figure 4.19.
#[inline]
pub fn sphere_meets_sphere(a: &Sphere, b: &Sphere) -> bool {
    let reach = a.radius + b.radius;
    (a.centre - b.centre).norm_squared() <= reach * reach
}

/// Whether a solid finite cylinder holds the whole sphere.
#[inline]
pub(super) fn cylinder_covers_sphere(cylinder: &Cylinder, sphere: &Sphere) -> bool {
    let centre = sphere.centre - cylinder.base;
    let s_z = centre.dot(&cylinder.axis);
    let room = cylinder.radius - sphere.radius;
    let d_min_squared = (centre - cylinder.axis.into_inner() * s_z).norm_squared();
    (s_z - cylinder.length).max(-s_z) <= -sphere.radius
        && room >= 0.0
        && d_min_squared <= room * room
}

/// Whether `outer` holds the whole of `inner`.
#[inline]
pub(super) fn sphere_covers_sphere(outer: &Sphere, inner: &Sphere) -> bool {
    let room = outer.radius - inner.radius;
    room >= 0.0 && (outer.centre - inner.centre).norm_squared() <= room * room
}

#[cfg(test)]
mod tests {
    use nalgebra::{Point3, Unit, Vector3};
    use proptest::prelude::*;

    use super::*;

    fn upright() -> Cylinder {
        Cylinder { base: Point3::origin(), axis: Vector3::z_axis(), length: 2.0, radius: 1.0 }
    }

    fn meets(x: f64, z: f64, radius: f64) -> bool {
        let sphere = Sphere { centre: Point3::new(x, 0.0, z), radius };
        cylinder_meets_sphere(&upright(), &sphere)
    }

    #[test]
    fn the_three_cases_decide_as_in_figures_4_16_to_4_18() {
        assert!(meets(1.4, 1.0, 0.5) && !meets(1.6, 1.0, 0.5));
        assert!(meets(1.3, 2.3, 0.5) && !meets(1.45, 2.3, 0.5));
        assert!(!meets(0.0, 2.6, 0.5) && !meets(0.0, -0.6, 0.5));
    }

    #[test]
    fn a_small_sphere_over_the_middle_of_an_end_is_found() {
        // Its circle in the end plane is far inside the end disc and touches no rim.
        assert!(meets(0.1, 2.05, 0.1) && meets(0.1, -0.05, 0.1));
    }

    #[test]
    fn a_point_inside_is_found_and_nan_is_not() {
        assert!(meets(0.0, 1.0, 0.0) && meets(1.0, 2.0, 0.0));
        assert!(!meets(f64::NAN, 1.0, 1.0) && !meets(0.0, 1.0, f64::NAN));
    }

    /// Distance to the cylinder by walking over its closest points' coordinates.
    fn naive_distance(cylinder: &Cylinder, point: &Point3<f64>) -> f64 {
        let along = (point - cylinder.base).dot(&cylinder.axis).clamp(0.0, cylinder.length);
        let foot = cylinder.base + cylinder.axis.into_inner() * along;
        let rejected = point - cylinder.base;
        let radial = rejected - cylinder.axis.into_inner() * rejected.dot(&cylinder.axis);
        let out = radial.norm().min(cylinder.radius);
        let closest = if radial.norm() > 0.0 { foot + radial.normalize() * out } else { foot };
        (point - closest).norm()
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(2000))]
        #[test]
        fn cylinder_test_equals_distance_to_the_solid(
            base in prop::array::uniform3(-1.0..1.0_f64),
            axis in prop::array::uniform3(-1.0..1.0_f64),
            centre in prop::array::uniform3(-3.0..3.0_f64),
            length in 0.0..2.0_f64,
            radii in prop::array::uniform2(0.0..1.0_f64),
        ) {
            prop_assume!(Vector3::from(axis).norm() > 1e-3);
            let cylinder = Cylinder {
                base: base.into(),
                axis: Unit::new_normalize(axis.into()),
                length,
                radius: radii[0],
            };
            let sphere = Sphere { centre: centre.into(), radius: radii[1] };
            let gap = naive_distance(&cylinder, &sphere.centre) - sphere.radius;
            prop_assume!(gap.abs() > 1e-9);
            prop_assert_eq!(cylinder_meets_sphere(&cylinder, &sphere), gap < 0.0);
            prop_assert!(gap < 0.0 || !cylinder_covers_sphere(&cylinder, &sphere));
        }
    }
}
