//! What the object is made of and how its displacements are solved for.

use softgrasp_core::fem::Element;
use softgrasp_core::solve::choose::cheapest_element;
use softgrasp_grasp::object::ContactModel;
use softgrasp_protocol::{Deformation, ElementName, Material, MethodName};

use crate::ask::deformation::Elasticity;

/// What the object is made of and how it is to be solved.
#[derive(Clone, Debug, PartialEq)]
pub struct SolveSettings {
    /// Its material.
    pub material: Material,
    /// Element of the model.
    pub element: ElementName,
    /// Method asked for.
    pub method: MethodName,
    /// What a fingertip holds.
    pub contact: ContactModel,
    /// Nodes whose displacements each tick asks for.
    pub subscription: Subscription,
    /// Which equations, and by which law.
    pub elasticity: Elasticity,
    /// Largest relative error that is acceptable; `None` leaves it to the method, at large
    /// deformation [`ERROR_OF_FRAMES`].
    pub max_error: Option<f64>,
}

impl SolveSettings {
    /// The error that frames may have where nobody says how much.
    pub fn error_of_frames(&self) -> Option<f64> {
        let is_linear = self.elasticity.deformation == Deformation::Linear;
        (!is_linear).then_some(ERROR_OF_FRAMES)
    }
}

/// Estimated error of a frame at large deformation, over the largest displacement, unless another is
/// asked for: a hundredth of what linear elasticity is off by.
pub const ERROR_OF_FRAMES: f64 = 2e-3;

/// The element of frames for a material, by Poisson's ratio: the cheapest that does not lock.
pub fn element_for_frames(poisson: f64) -> ElementName {
    match cheapest_element(poisson) {
        Element::Tet4 => ElementName::T4,
        Element::Tet4Anp => ElementName::T4Anp,
        Element::Tet10 => ElementName::T10,
    }
}

/// Nodes whose displacements each tick asks for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Subscription {
    /// What is seen and touched; the inside is asked for when a shape is to be kept.
    Surface,
    /// Every node: the whole object is written down.
    Whole,
}

/// What the answers of ticks are to hold and how good they are to be, as far as a person asks for it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct AnswerWishes {
    /// Largest relative error that is acceptable; `None` leaves it to the method.
    pub max_error: Option<f64>,
    /// Whether the forces of the fingertips are wanted: every answer has them, and on the wire they
    /// take room (`GraspLoop::fingertip_forces`).
    pub forces: bool,
}
