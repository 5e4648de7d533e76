//! The messages for large deformation, and what an answer reports about it.

use std::fmt;

use wincode::{SchemaRead, SchemaWrite};

use super::answer::{Answer, AnswerPart};
use super::large_ask::LargeAsk;
use super::mesh::{Material, MeshData, MeshPart, read_mesh, write_mesh};
use super::model::ModelHash;
use super::names::ElementChoice;
use super::question::{Question, QuestionPart};
use crate::payload::{PayloadReader, PayloadWriter};
use crate::{DecodeError, EncodeError, Limits};

/// Mesh, material, partition and question in one request, for large deformation.
///
/// All known displacements move in proportion, from rest to their values.
#[derive(Clone, Debug, PartialEq)]
pub struct SolveLarge {
    /// Nodes and elements.
    pub mesh: MeshData,
    /// One material, or one for each region.
    pub materials: Vec<Material>,
    /// Which element, or the server's choice.
    pub element: ElementChoice,
    /// Law, yield stress, and whether a linear answer may do.
    pub large: LargeAsk,
    /// What is known and asked.
    pub question: Question,
}

/// Question about a kept model, for large deformation.
///
/// A session follows one path per model: each frame goes on from the shape of the last one.
#[derive(Clone, Debug, PartialEq)]
pub struct LargeFrame {
    /// Which model.
    pub model: ModelHash,
    /// Law, yield stress, path and pace.
    pub large: LargeAsk,
    /// What is known and asked.
    pub question: Question,
}

/// Answer to `SolveLarge` and `LargeFrame`.
#[derive(Clone, Debug, PartialEq)]
pub struct LargeAnswer {
    /// Displacements, forces and the report of every answer.
    pub answer: Answer,
    /// What only large deformation has.
    pub large: LargeReport,
}

/// Deformation that an answer is of.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, SchemaRead, SchemaWrite)]
pub enum DeformationName {
    /// Linear elasticity.
    #[default]
    Linear,
    /// Equilibrium of the deformed body.
    Large,
}

/// Report of one solve for large deformation, beside the `SolveReport`.
///
/// Units: none; `…_rel` relative.
#[derive(Clone, Copy, Debug, Default, PartialEq, SchemaRead, SchemaWrite)]
pub struct LargeReport {
    /// Deformation that was used.
    pub deformation: DeformationName,
    /// Steps of Newton's method.
    pub newton_steps: u32,
    /// Linear systems that were solved.
    pub linear_solves: u32,
    /// Frames since the shape that the newest factor belongs to.
    pub factor_age: u32,
    /// Pieces that the motion of the known displacements was cut into.
    pub substeps: u32,
    /// Smallest ratio of an element's volume to that at rest.
    pub min_jacobian: f64,
    /// Estimated error in the energy norm over the energy norm of the displacement.
    pub energy_error_rel: Option<f64>,
    /// Largest principal stretch of an element, 1 at rest; NaN where it was not worked out for this
    /// answer.
    pub max_stretch: f64,
    /// Whether the equilibrium jumped (snap-through).
    pub jumped: bool,
    /// Whether the residual is at rounding or below 1e-8: nothing is gained by asking again.
    pub settled: bool,
    /// Largest accumulated plastic strain; 0 without yield stress.
    pub plastic_strain: f64,
}

#[derive(Clone, Debug, SchemaRead, SchemaWrite)]
struct SolveLargePart {
    mesh: MeshPart,
    element: ElementChoice,
    large: LargeAsk,
    question: QuestionPart,
}

#[derive(Clone, Debug, SchemaRead, SchemaWrite)]
struct LargeFramePart {
    model: ModelHash,
    large: LargeAsk,
    question: QuestionPart,
}

#[derive(Clone, Debug, SchemaRead, SchemaWrite)]
struct LargeAnswerPart {
    answer: AnswerPart,
    large: LargeReport,
}

impl SolveLarge {
    pub(super) fn write(&self, writer: &mut PayloadWriter<'_>) -> Result<(), EncodeError> {
        writer.part(&SolveLargePart {
            mesh: MeshPart::of(&self.mesh, &self.materials)?,
            element: self.element,
            large: self.large,
            question: self.question.part()?,
        })?;
        write_mesh(writer, &self.mesh, &self.materials);
        self.question.write_arrays(writer);
        Ok(())
    }

    pub(super) fn read(
        reader: &mut PayloadReader<'_>,
        limits: &Limits,
    ) -> Result<Self, DecodeError> {
        let part: SolveLargePart = reader.part()?;
        part.mesh.check(limits)?;
        part.question.check(limits)?;
        let (mesh, materials) = read_mesh(reader, &part.mesh)?;
        let question = Question::read_arrays(reader, part.question)?;
        Ok(Self { mesh, materials, element: part.element, large: part.large, question })
    }
}

impl LargeFrame {
    pub(super) fn write(&self, writer: &mut PayloadWriter<'_>) -> Result<(), EncodeError> {
        let question = self.question.part()?;
        writer.part(&LargeFramePart { model: self.model, large: self.large, question })?;
        self.question.write_arrays(writer);
        Ok(())
    }

    pub(super) fn read(
        reader: &mut PayloadReader<'_>,
        limits: &Limits,
    ) -> Result<Self, DecodeError> {
        let part: LargeFramePart = reader.part()?;
        part.question.check(limits)?;
        let question = Question::read_arrays(reader, part.question)?;
        Ok(Self { model: part.model, large: part.large, question })
    }
}

impl LargeAnswer {
    pub(super) fn write(&self, writer: &mut PayloadWriter<'_>) -> Result<(), EncodeError> {
        writer.part(&LargeAnswerPart { answer: self.answer.part()?, large: self.large })?;
        self.answer.write_arrays(writer);
        Ok(())
    }

    pub(super) fn read(
        reader: &mut PayloadReader<'_>,
        limits: &Limits,
    ) -> Result<Self, DecodeError> {
        let part: LargeAnswerPart = reader.part()?;
        part.answer.check(limits)?;
        Ok(Self { answer: Answer::read_arrays(reader, part.answer)?, large: part.large })
    }
}

impl DeformationName {
    /// Name used in reports.
    pub const fn as_str(self) -> &'static str {
        match self {
            Self::Linear => "linear",
            Self::Large => "large",
        }
    }
}

impl fmt::Display for DeformationName {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.as_str())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn deformations_are_shown_by_their_names() {
        assert_eq!(DeformationName::Linear.to_string(), "linear");
        assert_eq!(format!("{:>6}", DeformationName::Large), " large");
    }

    #[test]
    fn a_report_is_its_fields_one_behind_the_other() {
        let report = LargeReport {
            deformation: DeformationName::Large,
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
        let mut bytes: Vec<u8> = (1..=5_u32).flat_map(u32::to_le_bytes).collect();
        bytes.extend(0.5_f64.to_le_bytes());
        bytes.push(1);
        bytes.extend(1e-4_f64.to_le_bytes());
        bytes.extend(1.5_f64.to_le_bytes());
        bytes.extend([1, 0]);
        bytes.extend(0.25_f64.to_le_bytes());
        assert_eq!(wincode::serialize(&report).unwrap(), bytes);
        assert_eq!(wincode::deserialize::<LargeReport>(&bytes).unwrap(), report);
        bytes[0] = 2;
        assert!(wincode::deserialize::<LargeReport>(&bytes).is_err(), "no third deformation");
    }
}
