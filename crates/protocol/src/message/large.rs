//! Large deformation: what a client asks (law, yield stress, path, pace) and what an answer reports.

use std::fmt;
use std::str::FromStr;

use serde::Serialize;
use wincode::{SchemaRead, SchemaWrite};

/// What an `Ask` for large deformation says beside its question.
///
/// Units: `yield_stress` Pa.
#[derive(Clone, Copy, Debug, Default, PartialEq, SchemaRead, SchemaWrite)]
pub struct LargeAsk {
    /// Whether the server may answer by linear elasticity where that is accurate enough.
    pub deformation: Deformation,
    /// Law of the material: its stored energy.
    pub law: LawName,
    /// Stress above which the material flows and stays deformed; `None` for a material that never flows.
    pub yield_stress: Option<f64>,
    /// Where the path of the equilibrium begins; without effect for a mesh that comes along.
    pub path: PathChoice,
    /// Whether the elapsed time may decide what is done.
    pub pace: Pace,
}

/// Equations that are solved.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, SchemaRead, SchemaWrite)]
pub enum Deformation {
    /// Equilibrium of the deformed body.
    #[default]
    Large,
    /// Linear elasticity where rotation and strain promise an error within the budget, large
    /// deformation elsewhere.
    Auto,
    /// Linear elasticity (thesis 3.43). A server is asked for it by leaving [`LargeAsk`] out.
    Linear,
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

/// Where the path of the equilibrium begins for a question about a kept model.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, SchemaRead, SchemaWrite)]
pub enum PathChoice {
    /// At the shape of this session's last such question about this model; at rest if there is none.
    #[default]
    Continue,
    /// At the undeformed shape.
    FromRest,
}

/// Whether the elapsed time may decide what is done.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, SchemaRead, SchemaWrite)]
pub enum Pace {
    /// What is done does not depend on elapsed time: the same questions give the same bits.
    #[default]
    Repeatable,
    /// Factors made in the background are used as soon as they are ready.
    Timely,
}

/// A text that names no deformation.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{name:?} is no kind of deformation; there are linear, large and auto")]
pub struct DeformationError {
    /// The text that is no name of a deformation.
    pub name: String,
}

/// A text that names no law.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("no law is called {name:?}; there are neo-hookean and neo-hookean-log")]
pub struct LawNameError {
    /// The text that is no name of a law.
    pub name: String,
}

/// Report of one solve for large deformation, beside the `SolveReport`.
///
/// Units: none; `…_rel` relative.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, SchemaRead, SchemaWrite)]
pub struct LargeReport {
    /// Whether linear elasticity was accurate enough and gave the answer.
    #[serde(skip)]
    pub is_linear: bool,
    /// Number of steps of Newton's method.
    pub newton_steps: u32,
    /// Number of linear systems that were solved.
    pub linear_solves: u32,
    /// Number of questions since the shape that the newest factor belongs to.
    pub factor_age: u32,
    /// Number of pieces that the motion of the known displacements was cut into.
    pub substeps: u32,
    /// Smallest ratio of an element's volume to that at rest.
    pub min_jacobian: f64,
    /// Estimated error in the energy norm, relative to the energy norm of the displacement.
    pub energy_error_rel: Option<f64>,
    /// Largest principal stretch of an element, 1 at rest; NaN where it was not computed for this answer.
    pub max_stretch: f64,
    /// Whether the equilibrium jumped to another shape (snap-through).
    pub jumped: bool,
    /// Whether the residual is at rounding or below 1e-8, so that asking again gains nothing.
    pub settled: bool,
    /// Largest accumulated plastic strain; 0 without yield stress.
    pub plastic_strain: f64,
}

impl Deformation {
    /// Name of the deformation in commands and reports.
    pub const fn as_str(self) -> &'static str {
        match self {
            Self::Linear => "linear",
            Self::Large => "large",
            Self::Auto => "auto",
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

impl LargeReport {
    /// Whether the answer is that of linear elasticity or of large deformation.
    pub const fn deformation(&self) -> Deformation {
        match self.is_linear {
            true => Deformation::Linear,
            false => Deformation::Large,
        }
    }
}

impl LawName {
    /// Name of the law in commands and reports.
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
    fn deformations_read_back_and_others_are_told_what_there_is() {
        for deformation in [Deformation::Linear, Deformation::Large, Deformation::Auto] {
            assert_eq!(deformation.as_str().parse(), Ok(deformation));
            assert_eq!(format!("{deformation:>7}"), format!("{:>7}", deformation.as_str()));
        }
        let error = "huge".parse::<Deformation>().unwrap_err();
        assert_eq!(error.name, "huge");
        assert!(error.to_string().contains("linear, large and auto"), "{error}");
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
            deformation: Deformation::Auto,
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
        for (at, count) in [(0, 3), (4, 2), (9, 2), (13, 2)] {
            let mut bytes = [0; 17];
            bytes[at] = 1;
            assert!(wincode::deserialize::<LargeAsk>(&bytes).is_ok());
            bytes[at] = count;
            let error = wincode::deserialize::<LargeAsk>(&bytes).unwrap_err();
            assert!(matches!(error, wincode::ReadError::InvalidTagEncoding(_)), "{error}");
        }
    }

    #[test]
    fn a_report_is_its_fields_one_behind_the_other() {
        let report = LargeReport {
            is_linear: true,
            newton_steps: 2,
            linear_solves: 3,
            factor_age: 4,
            substeps: 5,
            min_jacobian: 0.5,
            energy_error_rel: Some(1e-4),
            max_stretch: 1.5,
            jumped: true,
            settled: false,
            plastic_strain: 0.25,
        };
        let mut bytes = vec![1];
        bytes.extend((2..=5_u32).flat_map(u32::to_le_bytes));
        bytes.extend(0.5_f64.to_le_bytes());
        bytes.push(1);
        bytes.extend(1e-4_f64.to_le_bytes());
        bytes.extend(1.5_f64.to_le_bytes());
        bytes.extend([1, 0]);
        bytes.extend(0.25_f64.to_le_bytes());
        assert_eq!(wincode::serialize(&report).unwrap(), bytes);
        assert_eq!(wincode::deserialize::<LargeReport>(&bytes).unwrap(), report);
        bytes[0] = 2;
        assert!(wincode::deserialize::<LargeReport>(&bytes).is_err(), "neither yes nor no");
    }
}
