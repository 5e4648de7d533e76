//! The request for displacements: of what, which question, linear or large, one case or several.

use wincode::{SchemaRead, SchemaWrite};

use super::large::LargeAsk;
use super::mesh::{Material, MeshData, MeshPart, read_mesh, write_mesh};
use super::model::ModelHash;
use super::names::ElementChoice;
use super::question::{Question, QuestionParts};
use super::report::ReportLevel;
use crate::block::Block;
use crate::limits::check_count;
use crate::payload::{PayloadReader, PayloadWriter, count_of};
use crate::trace::{TraceContext, TracePart};
use crate::{DecodeError, EncodeError, Frame, Kind, Limits};

/// Request for displacements, answered by `Answer`.
///
/// Source: thesis (5.1.1) for mesh, material, partition and question in one request.
#[derive(Clone, Debug, PartialEq)]
pub struct Ask {
    /// Mesh or kept model that the request is about.
    pub subject: Subject,
    /// Known displacements, forces and masks, and which results are wanted.
    pub question: Question,
    /// Large deformation: law, yield stress, path and pace; `None` for linear elasticity.
    pub large: Option<LargeAsk>,
    /// Further cases: values of the known displacements, in the order of the question's, which are
    /// the first case. One matrix and one factor solve all of them (thesis 3.43: `K11⁻¹` belongs to
    /// the partition, not to the values); forces act in all.
    ///
    /// Units: m.
    pub cases: Vec<Vec<f64>>,
    /// Whether to leave out the estimates that do not change the answer: condition, estimated error,
    /// rotation and strain.
    pub without_estimate: bool,
    /// Whether a newer request of this kind for the same model makes this one needless: one that has
    /// not been begun by then is refused with `Superseded`.
    pub newest_wins: bool,
    /// How much the report of the answer shall tell.
    pub report: ReportLevel,
}

/// What an [`Ask`] is about: a mesh or a kept model.
#[derive(Clone, Debug, PartialEq)]
pub enum Subject {
    /// A mesh that comes with the request; the server keeps nothing of it.
    Mesh(Box<Body>),
    /// A model that the server keeps, by the hash that names it.
    Model(ModelHash),
}

/// Mesh, material and element of one request.
#[derive(Clone, Debug, PartialEq)]
pub struct Body {
    /// Nodes and elements of the mesh.
    pub mesh: MeshData,
    /// One material for the whole body, or one for each region.
    pub materials: Vec<Material>,
    /// Kind of element, or the choice of it left to the server.
    pub element: ElementChoice,
}

#[derive(Clone, Debug, SchemaRead, SchemaWrite)]
struct AskPart {
    subject: SubjectPart,
    newest_wins: bool,
    question: Block,
    large: Option<Block>,
    case_count: u32,
    without_estimate: bool,
    report: ReportLevel,
}

/// The first fields of an [`AskPart`]; enough to know the kept model.
#[derive(Clone, Debug, SchemaRead, SchemaWrite)]
struct AskHead {
    subject: SubjectPart,
    newest_wins: bool,
}

#[derive(Clone, Debug, SchemaRead, SchemaWrite)]
enum SubjectPart {
    Mesh { mesh: MeshPart, element: ElementChoice },
    Model { model: ModelHash },
}

const CASES: &str = "cases";

impl Ask {
    /// A question about linear elasticity with one case.
    pub fn new(subject: impl Into<Subject>, question: Question) -> Self {
        Self {
            subject: subject.into(),
            question,
            large: None,
            cases: Vec::new(),
            without_estimate: false,
            newest_wins: false,
            report: ReportLevel::Full,
        }
    }

    /// Name of the kept model that an `Ask` is about, and the `newest_wins` of the request.
    ///
    /// Decodes only the first fields of the part.
    pub fn kept_model(frame: &Frame) -> Option<(ModelHash, bool)> {
        if frame.kind() != Some(Kind::Ask) {
            return None;
        }
        let head: AskHead = PayloadReader::new(&frame.payload).part().ok()?;
        match head.subject {
            SubjectPart::Model { model } => Some((model, head.newest_wins)),
            SubjectPart::Mesh { .. } => None,
        }
    }

    /// Writes the arrays: those of the mesh if it comes along, those of the question, the cases one by
    /// one.
    pub(super) fn write(&self, writer: &mut PayloadWriter<'_>) -> Result<(), EncodeError> {
        let expected = self.question.known.len();
        if let Some(case) = self.cases.iter().find(|case| case.len() != expected) {
            let (what, count) = ("displacements of a case", case.len());
            return Err(EncodeError::CountMismatch { what, count, expected });
        }
        writer.part(&AskPart {
            subject: match &self.subject {
                Subject::Mesh(body) => SubjectPart::Mesh {
                    mesh: MeshPart::of(&body.mesh, &body.materials)?,
                    element: body.element,
                },
                Subject::Model(model) => SubjectPart::Model { model: *model },
            },
            newest_wins: self.newest_wins,
            question: self.question.block()?,
            large: self.large.as_ref().map(Block::of).transpose()?,
            case_count: count_of(CASES, self.cases.len())?,
            without_estimate: self.without_estimate,
            report: self.report,
        })?;
        if let Subject::Mesh(body) = &self.subject {
            write_mesh(writer, &body.mesh, &body.materials);
        }
        self.question.write_arrays(writer);
        for case in &self.cases {
            writer.array(case);
        }
        Ok(())
    }

    /// Trace that the request in a frame belongs to.
    pub(super) fn trace(frame: &Frame) -> Option<TraceContext> {
        let mut reader = PayloadReader::new(&frame.payload);
        let (_, later): (AskPart, TracePart) = reader.part_and_later().ok()?;
        later.trace
    }

    pub(super) fn read(
        reader: &mut PayloadReader<'_>,
        limits: &Limits,
    ) -> Result<Self, DecodeError> {
        let part: AskPart = reader.part()?;
        let question = QuestionParts::read(&part.question, limits)?;
        let large = part.large.map(|block| block.read()).transpose()?;
        let case_count = check_count(CASES, part.case_count, limits.dof_count_max)?;
        let subject = match part.subject {
            SubjectPart::Mesh { mesh, element } => {
                mesh.check(limits)?;
                let (mesh, materials) = read_mesh(reader, &mesh)?;
                Subject::Mesh(Box::new(Body { mesh, materials, element }))
            }
            SubjectPart::Model { model } => Subject::Model(model),
        };
        let question = Question::read_arrays(reader, question)?;
        if case_count > 0 && question.known.is_empty() {
            // Cases without a number take no bytes, so that any count of them would pass.
            let count = part.case_count;
            return Err(DecodeError::TooMany { what: CASES, count, count_max: 0 });
        }
        let mut cases = Vec::new();
        for _ in 0..case_count {
            cases.push(reader.array("displacements of a case", question.known.len())?);
        }
        Ok(Self {
            subject,
            question,
            large,
            cases,
            without_estimate: part.without_estimate,
            newest_wins: part.newest_wins,
            report: part.report,
        })
    }
}

impl From<ModelHash> for Subject {
    fn from(model: ModelHash) -> Self {
        Self::Model(model)
    }
}

impl From<Body> for Subject {
    fn from(body: Body) -> Self {
        Self::Mesh(Box::new(body))
    }
}
