//! Material of the object, equations of its deformation, and method by which displacements are solved
//! for.

use softgrasp_core::fem::Element;
use softgrasp_core::solve::choose::cheapest_element;
use softgrasp_grasp::object::ContactModel;
use softgrasp_protocol::{
    Deformation, ElementName, LargeAsk, LawName, Material, MethodName, Pace, PathChoice,
};

/// Material of the object, and settings of its solves.
#[derive(Clone, Debug, PartialEq)]
pub struct SolveSettings {
    /// Elastic material of the object.
    pub material: Material,
    /// Element of the model.
    pub element: ElementName,
    /// Solution method, or `auto`.
    pub method: MethodName,
    /// What a fingertip holds: a node, a patch or a mask.
    pub contact: ContactModel,
    /// Nodes whose displacements each tick asks for.
    pub subscription: Subscription,
    /// Equations and law of the deformation.
    pub elasticity: Elasticity,
    /// Largest relative error that is acceptable; `None` leaves it to the method, or takes
    /// [`ERROR_OF_FRAMES`] at large deformation.
    pub max_error: Option<f64>,
}

impl SolveSettings {
    /// Relative error that answers to ticks may have, if none was asked for.
    pub fn error_of_frames(&self) -> Option<f64> {
        let is_linear = self.elasticity.deformation == Deformation::Linear;
        (!is_linear).then_some(ERROR_OF_FRAMES)
    }
}

/// Estimated error of an answer at large deformation, relative to the largest displacement, unless
/// another one is asked for: a hundredth of the error of linear elasticity.
pub const ERROR_OF_FRAMES: f64 = 2e-3;

/// Element for the ticks by Poisson's ratio: the cheapest that does not lock.
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
    /// Nodes of the surface; the inside is asked for when a shape is to be kept.
    Surface,
    /// Every node, because the whole object is written to files.
    Whole,
}

/// Wishes of a person for the answers of ticks.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct AnswerWishes {
    /// Largest relative error that is acceptable; `None` leaves it to the method.
    pub max_error: Option<f64>,
    /// Whether the forces of the fingertips are wanted. Every answer has them; on the wire they take room
    /// (`GraspLoop::fingertip_forces`).
    pub forces: bool,
}

/// Deformation, law and yield stress of an object.
///
/// Units: Pa.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Elasticity {
    /// Equations of the deformation: linear, large or auto.
    pub deformation: Deformation,
    /// Law of large deformation.
    pub law: LawName,
    /// Stress above which the material flows and stays deformed; `None` for never.
    pub yield_stress: Option<f64>,
}

impl Elasticity {
    /// Linear elasticity, as in the thesis.
    pub const LINEAR: Self =
        Self { deformation: Deformation::Linear, law: LawName::NeoHookean, yield_stress: None };

    /// Wish for large deformation in a question; `None` for a linear question.
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
