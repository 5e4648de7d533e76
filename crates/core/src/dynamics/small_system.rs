//! The small system of a step: how the resultant forces of the bodies that press follow from where these
//! bodies are, to first order about the end of the step.

use nalgebra::{DMatrix, Point3, Vector3};

/// A body that presses on the object, as one force at one place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BodyContact {
    /// Position in the list of bodies.
    pub body: u16,
    /// Where its forces act on average, m, world.
    pub place: Point3<f64>,
    /// Unit normal out of the body: that of the resultant of the normal forces, world.
    pub normal: Vector3<f64>,
    /// Force on the object, N, world.
    pub force: Vector3<f64>,
    /// Coefficient of friction.
    pub friction: f64,
}

/// The bodies that press, and the compliance between them.
///
/// Shapes: m contacts; `compliance` 3m × 3m, symmetric, positive definite, in the order of the contacts.
/// Units: m/N. Frame: world.
#[derive(Clone, Debug, PartialEq)]
pub struct SmallSystem {
    /// One contact for each body that presses, by ascending position.
    pub contacts: Vec<BodyContact>,
    /// Place of each contact per force at each.
    pub compliance: DMatrix<f64>,
}
