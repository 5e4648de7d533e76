//! How far a deformation may go: linear elasticity, large deformation, or what the scene needs.

use std::fmt;
use std::str::FromStr;

use softgrasp_protocol::{DeformationChoice, LargeAsk, LawName, Pace, PathChoice};

/// Which equations are solved.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Deformation {
    /// Those of small deformation (thesis 3.43).
    Linear,
    /// Those of large deformation.
    Large,
    /// The linear ones where they promise an error within what is allowed, else the others.
    Auto,
}

/// A name that is none of the three.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{name:?} is no kind of deformation; there are linear, large and auto")]
pub struct DeformationError {
    /// The name given.
    pub name: String,
}

impl Deformation {
    /// Name on the command line and in reports.
    pub fn as_str(self) -> &'static str {
        match self {
            Self::Linear => "linear",
            Self::Large => "large",
            Self::Auto => "auto",
        }
    }
}

impl Deformation {
    /// What a server is asked; none where linear elasticity is.
    pub fn choice(self) -> Option<DeformationChoice> {
        match self {
            Self::Linear => None,
            Self::Large => Some(DeformationChoice::Large),
            Self::Auto => Some(DeformationChoice::Auto),
        }
    }
}

impl FromStr for Deformation {
    type Err = DeformationError;

    fn from_str(name: &str) -> Result<Self, DeformationError> {
        [Self::Linear, Self::Large, Self::Auto]
            .into_iter()
            .find(|deformation| deformation.as_str() == name)
            .ok_or_else(|| DeformationError { name: name.to_owned() })
    }
}

impl fmt::Display for Deformation {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.as_str())
    }
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
        let deformation = self.deformation.choice()?;
        let Self { law, yield_stress, .. } = *self;
        Some(LargeAsk { deformation, law, yield_stress, path, pace })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_read_back_and_others_are_told_what_there_is() {
        for deformation in [Deformation::Linear, Deformation::Large, Deformation::Auto] {
            assert_eq!(deformation.as_str().parse(), Ok(deformation));
        }
        let error = "huge".parse::<Deformation>().unwrap_err().to_string();
        assert!(error.contains("linear, large and auto"), "{error}");
    }

    #[test]
    fn linear_questions_ask_nothing_of_large_deformation() {
        assert_eq!(Elasticity::LINEAR.ask(PathChoice::Continue, Pace::Timely), None);
        let auto = Elasticity { deformation: Deformation::Auto, ..Elasticity::LINEAR };
        let ask = auto.ask(PathChoice::FromRest, Pace::Repeatable).unwrap();
        assert_eq!(ask.deformation, DeformationChoice::Auto);
    }
}
