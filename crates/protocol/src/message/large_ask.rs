//! What a client asks about large deformation: law, yield stress, path and pace.

use std::fmt;
use std::str::FromStr;

use wincode::{SchemaRead, SchemaWrite};

/// What a `SolveLarge` and a `LargeFrame` ask beside their question.
///
/// Units: `yield_stress` Pa.
#[derive(Clone, Copy, Debug, Default, PartialEq, SchemaRead, SchemaWrite)]
pub struct LargeAsk {
    /// Whether the server may answer linearly where that is good enough.
    pub deformation: DeformationChoice,
    /// Energy of the material.
    pub law: LawName,
    /// Above it the material flows and stays deformed; `None` for a material that never flows.
    pub yield_stress: Option<f64>,
    /// Where the path begins; of no effect for a `SolveLarge`.
    pub path: PathChoice,
    /// Whether the clock may decide what is done.
    pub pace: Pace,
}

/// Deformation wanted; `LargeReport` tells which was used.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, SchemaRead, SchemaWrite)]
pub enum DeformationChoice {
    /// Equilibrium of the deformed body.
    #[default]
    Large,
    /// Linear where rotation and strain promise an error within the budget, large elsewhere.
    Auto,
}

/// Energy W of the material per volume at rest, F being the deformation gradient and J = det F.
///
/// The constants μ, κ and λ follow from Young's modulus and Poisson's ratio.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, SchemaRead, SchemaWrite)]
pub enum LawName {
    /// W = μ/2 (J^(−2/3) tr FᵀF − 3) + κ/2 (J − 1)².
    #[default]
    NeoHookean,
    /// W = μ/2 (tr FᵀF − 3) − μ ln J + λ/2 ln² J.
    NeoHookeanLog,
}

/// Where the path of a `LargeFrame` begins.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, SchemaRead, SchemaWrite)]
pub enum PathChoice {
    /// At the shape of this session's last `LargeFrame` on this model; at rest if there is none.
    #[default]
    Continue,
    /// At rest.
    FromRest,
}

/// Whether the clock may decide what is done.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, SchemaRead, SchemaWrite)]
pub enum Pace {
    /// What is done does not depend on the clock: the same frames give the same bits.
    #[default]
    Repeatable,
    /// Work made beside the frames is used as soon as it is there.
    Timely,
}

/// A text that names no choice of [`DeformationChoice`].
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{name:?} is no choice of large deformation; there are large and auto")]
pub struct DeformationChoiceError {
    /// The text.
    pub name: String,
}

/// A text that names no law.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("no law is called {name:?}; there are neo-hookean and neo-hookean-log")]
pub struct LawNameError {
    /// The text.
    pub name: String,
}

impl FromStr for DeformationChoice {
    type Err = DeformationChoiceError;

    fn from_str(name: &str) -> Result<Self, DeformationChoiceError> {
        match name {
            "large" => Ok(Self::Large),
            "auto" => Ok(Self::Auto),
            _ => Err(DeformationChoiceError { name: name.to_owned() }),
        }
    }
}

impl LawName {
    /// Name used in commands and reports.
    pub const fn as_str(self) -> &'static str {
        match self {
            Self::NeoHookean => "neo-hookean",
            Self::NeoHookeanLog => "neo-hookean-log",
        }
    }
}

impl FromStr for LawName {
    type Err = LawNameError;

    fn from_str(name: &str) -> Result<Self, LawNameError> {
        match name {
            "neo-hookean" => Ok(Self::NeoHookean),
            "neo-hookean-log" => Ok(Self::NeoHookeanLog),
            _ => Err(LawNameError { name: name.to_owned() }),
        }
    }
}

impl fmt::Display for LawName {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.as_str())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn choices_of_deformation_are_read_from_their_names() {
        assert_eq!("large".parse(), Ok(DeformationChoice::Large));
        assert_eq!("auto".parse(), Ok(DeformationChoice::Auto));
        for other in ["linear", "Large", ""] {
            let error = other.parse::<DeformationChoice>().unwrap_err();
            assert_eq!(error.name, other);
            assert!(error.to_string().contains("large and auto"));
        }
    }

    #[test]
    fn laws_read_back_from_their_names() {
        for law in [LawName::NeoHookean, LawName::NeoHookeanLog] {
            assert_eq!(law.as_str().parse(), Ok(law));
            assert_eq!(law.to_string(), law.as_str());
        }
        let error = "hooke".parse::<LawName>().unwrap_err();
        assert_eq!(error.name, "hooke");
        let told = [LawName::NeoHookean, LawName::NeoHookeanLog].map(LawName::as_str).join(" and ");
        assert!(error.to_string().ends_with(&told), "{error}");
    }

    #[test]
    fn an_ask_is_its_fields_one_behind_the_other() {
        let ask = LargeAsk {
            deformation: DeformationChoice::Auto,
            law: LawName::NeoHookeanLog,
            yield_stress: Some(1500.0),
            path: PathChoice::FromRest,
            pace: Pace::Timely,
        };
        let mut bytes = vec![1, 0, 0, 0, 1, 0, 0, 0, 1];
        bytes.extend(1500.0_f64.to_le_bytes());
        bytes.extend([1, 0, 0, 0, 1, 0, 0, 0]);
        assert_eq!(wincode::serialize(&ask).unwrap(), bytes);
        assert_eq!(wincode::serialize(&LargeAsk::default()).unwrap(), [0; 17]);
    }

    #[test]
    fn a_variant_that_does_not_exist_is_no_ask() {
        for at in [0, 4, 9, 13] {
            let mut bytes = [0; 17];
            bytes[at] = 1;
            assert!(wincode::deserialize::<LargeAsk>(&bytes).is_ok());
            bytes[at] = 2;
            let error = wincode::deserialize::<LargeAsk>(&bytes).unwrap_err();
            assert!(matches!(error, wincode::ReadError::InvalidTagEncoding(2)), "{error}");
        }
    }
}
