//! How far a deformation may go: linear elasticity, large deformation, or what the scene needs.

use softgrasp_protocol::{Deformation, LargeAsk, LawName, Pace, PathChoice};

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
