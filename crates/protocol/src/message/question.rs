//! The question that a client asks about a mesh or a kept model.

use wincode::{SchemaRead, SchemaWrite};

use super::dof_value::DofValue;
use super::fields::FieldSet;
use super::gradient::{Quantity, QuantityPart};
use super::masks::{Masks, MasksPart};
use super::names::MethodName;
use super::spread_loads::{SpreadLoads, SpreadLoadsPart};
use crate::block::{Block, read_fields};
use crate::limits::check_count;
use crate::payload::{PayloadReader, PayloadWriter, count_of};
use crate::{DecodeError, EncodeError, Limits};

/// Nodes whose displacements are answered.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub enum NodeChoice {
    /// Every node of the mesh, in its order.
    #[default]
    All,
    /// These nodes, in this order.
    Nodes(Vec<u32>),
}

/// Precision in which displacements travel.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, SchemaRead, SchemaWrite)]
pub enum Precision {
    /// Eight bytes for each component, as computed.
    #[default]
    F64,
    /// Four bytes for each component, rounded to 2⁻²⁴ of the largest one.
    F32Quantised,
}

/// Results that the answer shall contain.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Want {
    /// Nodes whose displacements are wanted.
    pub nodes: NodeChoice,
    /// Whether the reaction forces at the known degrees of freedom are wanted.
    pub reactions: bool,
    /// Precision in which displacements travel.
    pub precision: Precision,
    /// Fields of strain, stress and energy that are wanted beside the displacements.
    pub fields: FieldSet,
}

/// Known displacements, loads and masks of the first case; accuracy and time that are wanted.
///
/// Units: `known` and `mask_displacements` m, `forces` N, `max_error` relative, `deadline_ms` ms from
/// the arrival.
///
/// Source: thesis (3.41) to (3.43) for the partition, 4.5.1 for where known displacements come from.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Question {
    /// Known displacements (Dirichlet values), m.
    pub known: Vec<DofValue>,
    /// Forces at unknown degrees of freedom, N; where none is named the force is zero.
    pub forces: Vec<DofValue>,
    /// Masks: nodes held together by their weighted mean, with one force for each mask.
    pub masks: Masks,
    /// Prescribed mean displacement of each mask, m.
    pub mask_displacements: Vec<[f64; 3]>,
    /// Solution method, or `auto`.
    pub method: MethodName,
    /// Results that the answer shall contain.
    pub want: Want,
    /// Largest relative error that is acceptable; `None` leaves it to the method.
    pub max_error: Option<f64>,
    /// Time after which the answer is of little use, ms; `None` for no deadline.
    pub deadline_ms: Option<f64>,
    /// Weight and pressure. A server without the capability `loads` refuses them as `BadRequest`.
    pub spread: SpreadLoads,
    /// Quantity whose derivatives are wanted; none where it has no term. A server without the capability
    /// `gradients` refuses it as `BadRequest`.
    pub quantity: Quantity,
}

/// Announces the arrays of a [`Question`].
#[derive(Clone, Debug, SchemaRead, SchemaWrite)]
struct QuestionPart {
    method: String,
    nodes: NodeChoicePart,
    reactions: bool,
    precision: Precision,
    max_error: Option<f64>,
    deadline_ms: Option<f64>,
    known_count: u32,
    force_count: u32,
    masks: MasksPart,
    fields: FieldSet,
}

/// Announces the arrays of a [`Question`] and, in fields that came later, those of its loads and its
/// quantity.
pub(super) struct QuestionParts {
    question: QuestionPart,
    later: LaterParts,
}

/// Fields that came later, in their order.
#[derive(Clone, Copy, Debug, Default, SchemaRead, SchemaWrite)]
struct LaterParts {
    spread: SpreadLoadsPart,
    quantity: QuantityPart,
}

#[derive(Clone, Copy, Debug, SchemaRead, SchemaWrite)]
enum NodeChoicePart {
    All,
    Nodes { count: u32 },
}

impl Question {
    /// The block of the part's fields; loads that are none, and a quantity that is none, take no bytes.
    pub(super) fn block(&self) -> Result<Block, EncodeError> {
        let block = Block::of(&self.part()?)?;
        let block = match self.spread.is_empty() && self.quantity.is_empty() {
            true => return Ok(block),
            false => block.and(&self.spread.part()?)?,
        };
        match self.quantity.is_empty() {
            true => Ok(block),
            false => block.and(&self.quantity.part()?),
        }
    }

    fn part(&self) -> Result<QuestionPart, EncodeError> {
        let nodes = match &self.want.nodes {
            NodeChoice::All => NodeChoicePart::All,
            NodeChoice::Nodes(nodes) => {
                NodeChoicePart::Nodes { count: count_of("wanted nodes", nodes.len())? }
            }
        };
        let (count, expected) = (self.mask_displacements.len(), self.masks.len());
        if count != expected {
            let what = "displacements of masks";
            return Err(EncodeError::CountMismatch { what, count, expected });
        }
        Ok(QuestionPart {
            method: self.method.as_str().to_owned(),
            nodes,
            reactions: self.want.reactions,
            precision: self.want.precision,
            max_error: self.max_error,
            deadline_ms: self.deadline_ms,
            known_count: count_of("known displacements", self.known.len())?,
            force_count: count_of("forces", self.forces.len())?,
            masks: self.masks.part()?,
            fields: self.want.fields,
        })
    }

    /// Writes the arrays: known displacements, forces, wanted nodes if listed, masks and their
    /// displacements, weight and pressure, terms of the quantity.
    pub(super) fn write_arrays(&self, writer: &mut PayloadWriter<'_>) {
        writer.dof_values(&self.known);
        writer.dof_values(&self.forces);
        if let NodeChoice::Nodes(nodes) = &self.want.nodes {
            writer.array(nodes);
        }
        self.masks.write_arrays(writer);
        writer.array(&self.mask_displacements);
        self.spread.write_arrays(writer);
        self.quantity.write_arrays(writer);
    }

    /// Reads the arrays that [`write_arrays`](Self::write_arrays) wrote; the counts have been checked.
    pub(super) fn read_arrays(
        reader: &mut PayloadReader<'_>,
        QuestionParts { question: part, later: LaterParts { spread, quantity } }: QuestionParts,
    ) -> Result<Self, DecodeError> {
        let method = MethodName::try_new(part.method)?;
        let known = reader.dof_values("known displacements", part.known_count as usize)?;
        let forces = reader.dof_values("forces", part.force_count as usize)?;
        let nodes = match part.nodes {
            NodeChoicePart::All => NodeChoice::All,
            NodeChoicePart::Nodes { count } => {
                NodeChoice::Nodes(reader.array("wanted nodes", count as usize)?)
            }
        };
        let (reactions, precision, fields) = (part.reactions, part.precision, part.fields);
        let want = Want { nodes, reactions, precision, fields };
        let masks = Masks::read_arrays(reader, part.masks)?;
        let mask_displacements = reader.array("displacements of masks", masks.len())?;
        let spread = SpreadLoads::read_arrays(reader, spread)?;
        let quantity = Quantity::read_arrays(reader, quantity)?;
        let (max_error, deadline_ms) = (part.max_error, part.deadline_ms);
        Ok(Self {
            known,
            forces,
            masks,
            mask_displacements,
            method,
            want,
            max_error,
            deadline_ms,
            spread,
            quantity,
        })
    }
}

impl QuestionParts {
    /// The parts that a block holds, checked against the limits.
    pub(super) fn read(block: &Block, limits: &Limits) -> Result<Self, DecodeError> {
        let (question, rest): (QuestionPart, &[u8]) = block.read_first()?;
        let later = match rest.is_empty() {
            true => LaterParts::default(),
            false => read_fields(rest)?,
        };
        question.check(limits)?;
        later.spread.check(limits)?;
        later.quantity.check(limits)?;
        Ok(Self { question, later })
    }
}

impl QuestionPart {
    fn check(&self, limits: &Limits) -> Result<(), DecodeError> {
        limits.check_text("method", &self.method)?;
        check_count("known displacements", self.known_count, limits.dof_count_max)?;
        check_count("forces", self.force_count, limits.dof_count_max)?;
        self.masks.check(limits)?;
        if let NodeChoicePart::Nodes { count } = self.nodes {
            check_count("wanted nodes", count, limits.node_count_max)?;
        }
        Ok(())
    }
}
