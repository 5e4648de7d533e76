//! How far a point is from a rigid body, and which point of a triangle is deepest in it.

use nalgebra::{Unit, Vector3};

use super::closest::Barycentric;

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
