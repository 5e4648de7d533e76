//! The messages for several sets of displacements of one partition: one matrix, one factor.

use wincode::{SchemaRead, SchemaWrite};

use super::answer::{Answer, AnswerPart};
use super::mesh::{Material, MeshData, MeshPart, read_mesh, write_mesh};
use super::names::ElementChoice;
use super::question::{Question, QuestionPart};
use crate::limits::check_count;
use crate::payload::{PayloadReader, PayloadWriter, count_of};
use crate::{DecodeError, EncodeError, Limits};

/// `SolveOnce` for several sets of values of the same known displacements.
///
/// Source: thesis (3.43): `K11⁻¹` belongs to the partition, not to the values.
#[derive(Clone, Debug, PartialEq)]
pub struct SolveSeveral {
    /// Nodes and elements.
    pub mesh: MeshData,
    /// One material, or one for each region.
    pub materials: Vec<Material>,
    /// Which element, or the server's choice.
    pub element: ElementChoice,
    /// What is known and asked; its known displacements are the first case. Forces act in all.
    pub question: Question,
    /// Further cases: values of the known displacements, in the order of the question's.
    ///
    /// Units: m.
    pub cases: Vec<Vec<f64>>,
    /// Whether to report what only informs: condition, estimated error, rotation and strain.
    pub estimate: bool,
}

/// Answer to `SolveSeveral`.
#[derive(Clone, Debug, PartialEq)]
pub struct SeveralAnswers {
    /// The first case and the report of all; what is reported of errors is the worst of them.
    pub answer: Answer,
    /// The further cases.
    pub cases: Vec<CaseAnswer>,
}

/// Displacements and forces of one further case, always in double precision.
#[derive(Clone, Debug, PartialEq)]
pub struct CaseAnswer {
    /// Displacements of the same nodes as the first case's, m.
    pub displacements: Vec<[f64; 3]>,
    /// Forces at the same degrees of freedom as the first case's, N.
    pub reactions: Vec<f64>,
}

#[derive(Clone, Debug, SchemaRead, SchemaWrite)]
struct SolveSeveralPart {
    mesh: MeshPart,
    element: ElementChoice,
    estimate: bool,
    case_count: u32,
    question: QuestionPart,
}

#[derive(Clone, Debug, SchemaRead, SchemaWrite)]
struct SeveralAnswersPart {
    answer: AnswerPart,
    case_count: u32,
}

const CASES: &str = "cases";

impl SolveSeveral {
    pub(super) fn write(&self, writer: &mut PayloadWriter<'_>) -> Result<(), EncodeError> {
        let expected = self.question.known.len();
        if let Some(case) = self.cases.iter().find(|case| case.len() != expected) {
            let (what, count) = ("displacements of a case", case.len());
            return Err(EncodeError::CountMismatch { what, count, expected });
        }
        writer.part(&SolveSeveralPart {
            mesh: MeshPart::of(&self.mesh, &self.materials)?,
            element: self.element,
            estimate: self.estimate,
            case_count: count_of(CASES, self.cases.len())?,
            question: self.question.part()?,
        })?;
        write_mesh(writer, &self.mesh, &self.materials);
        self.question.write_arrays(writer);
        self.cases.iter().for_each(|case| writer.array(case));
        Ok(())
    }

    pub(super) fn read(
        reader: &mut PayloadReader<'_>,
        limits: &Limits,
    ) -> Result<Self, DecodeError> {
        let part: SolveSeveralPart = reader.part()?;
        part.mesh.check(limits)?;
        part.question.check(limits)?;
        let case_count = check_count(CASES, part.case_count, limits.dof_count_max)?;
        let (mesh, materials) = read_mesh(reader, &part.mesh)?;
        let question = Question::read_arrays(reader, part.question)?;
        if case_count > 0 && question.known.is_empty() {
            // Cases without a number take no bytes, so that any count of them would pass.
            let count = part.case_count;
            return Err(DecodeError::TooMany { what: CASES, count, count_max: 0 });
        }
        let mut cases = Vec::new();
        for _ in 0..case_count {
            cases.push(reader.array("displacements of a case", question.known.len())?);
        }
        let (element, estimate) = (part.element, part.estimate);
        Ok(Self { mesh, materials, element, question, cases, estimate })
    }
}

impl SeveralAnswers {
    pub(super) fn write(&self, writer: &mut PayloadWriter<'_>) -> Result<(), EncodeError> {
        let nodes = self.answer.displacements.node_count();
        let reactions = self.answer.reactions.len();
        for case in &self.cases {
            for (what, count, expected) in [
                ("displacements of a case", case.displacements.len(), nodes),
                ("reactions of a case", case.reactions.len(), reactions),
            ] {
                if count != expected {
                    return Err(EncodeError::CountMismatch { what, count, expected });
                }
            }
        }
        let case_count = count_of(CASES, self.cases.len())?;
        writer.part(&SeveralAnswersPart { answer: self.answer.part()?, case_count })?;
        self.answer.write_arrays(writer);
        for case in &self.cases {
            writer.array(&case.displacements);
            writer.array(&case.reactions);
        }
        Ok(())
    }

    pub(super) fn read(
        reader: &mut PayloadReader<'_>,
        limits: &Limits,
    ) -> Result<Self, DecodeError> {
        let part: SeveralAnswersPart = reader.part()?;
        part.answer.check(limits)?;
        let case_count = check_count(CASES, part.case_count, limits.dof_count_max)?;
        let answer = Answer::read_arrays(reader, part.answer)?;
        let (nodes, reactions) = (answer.displacements.node_count(), answer.reactions.len());
        if case_count > 0 && nodes + reactions == 0 {
            let count = part.case_count;
            return Err(DecodeError::TooMany { what: CASES, count, count_max: 0 });
        }
        let mut cases = Vec::new();
        for _ in 0..case_count {
            cases.push(CaseAnswer {
                displacements: reader.array("displacements of a case", nodes)?,
                reactions: reader.array("reactions of a case", reactions)?,
            });
        }
        Ok(Self { answer, cases })
    }
}
