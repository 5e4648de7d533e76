//! What the object is made of, how far its deformation may go, and how its displacements are solved for.

use softgrasp_core::fem::Element;
use softgrasp_core::solve::choose::cheapest_element;
use softgrasp_grasp::object::ContactModel;
use softgrasp_protocol::{
    Deformation, ElementName, LargeAsk, LawName, Material, MethodName, Pace, PathChoice,
};

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

/// Deformation, law and yield stress of an object.
///
/// Units: Pa.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Elasticity {
    /// Which equations.
    pub deformation: Deformation,
    /// Law of large deformation.
    pub law: LawName,
    /// Above it the material flows and stays deformed.
    pub yield_stress: Option<f64>,
}

impl Elasticity {
    /// That of the thesis.
    pub const LINEAR: Self =
        Self { deformation: Deformation::Linear, law: LawName::NeoHookean, yield_stress: None };

    /// What a server is asked; `None` where a question of the linear kind is asked.
    pub fn ask(&self, path: PathChoice, pace: Pace) -> Option<LargeAsk> {
        let Self { deformation, law, yield_stress } = *self;
        (deformation != Deformation::Linear).then_some(LargeAsk {
            deformation,
            law,
            yield_stress,
            path,
            pace,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn linear_questions_ask_nothing_of_large_deformation() {
        assert_eq!(Elasticity::LINEAR.ask(PathChoice::Continue, Pace::Timely), None);
        let auto = Elasticity { deformation: Deformation::Auto, ..Elasticity::LINEAR };
        let ask = auto.ask(PathChoice::FromRest, Pace::Repeatable).unwrap();
        assert_eq!(ask.deformation, Deformation::Auto);
    }
}
