//! Solids that approximate the hand (thesis Figure 4.14), in one frame of coordinates.

use nalgebra::{Point3, Unit, Vector3};

/// Finite cylinder around a finger segment.
///
/// Units: m. Frame: whichever frame its points are given in.
///
/// Source: thesis section 4.4.1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cylinder {
    /// Centre of the lower end (`cl_z` of thesis 4.4.2).
    pub base: Point3<f64>,
    /// Unit direction from the lower to the upper end.
    pub axis: Unit<Vector3<f64>>,
    /// Distance between the ends, ≥ 0.
    pub length: f64,
    /// Radius `r_c`, > 0.
    pub radius: f64,
}

/// Sphere, used for tree nodes and for fingertip hemispheres (a hemisphere's flat side lies inside
/// its finger's cylinder, so the whole sphere is tested, as in thesis 4.4.2).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sphere {
    /// Centre of the sphere.
    pub centre: Point3<f64>,
    /// Radius of the sphere, ≥ 0.
    pub radius: f64,
}
