//! The messages for contact with friction: one step of a free object among rigid bodies.

use wincode::{SchemaRead, SchemaWrite};

use super::answer::{Answer, AnswerPart};
use super::fields::FieldSet;
use super::large::{Deformation, LawName, PathChoice};
use super::model::ModelHash;
use super::object_state::{ObjectState, ObjectStatePart};
use super::question::{NodeChoice, Precision};
use super::rigid_body::{BodyMotion, check_bodies, count_of_bodies, read_bodies, write_bodies};
use super::small_system::SmallSystem;
use crate::block::Block;
use crate::limits::check_count;
use crate::payload::{PayloadReader, PayloadWriter, count_of};
use crate::trace::{TraceContext, TracePart};
use crate::{DecodeError, EncodeError, Frame, Limits};

/// One step of a kept model that no fixed degree of freedom holds, among rigid bodies. The state comes
/// with the request and goes back with the answer; the server does not depend on an earlier one.
#[derive(Clone, Debug, PartialEq)]
pub struct ContactFrame {
    /// Name of the kept model.
    pub model: ModelHash,
    /// Length, physical constants and accuracy of the step.
    pub ask: ContactAsk,
    /// State of the object at the beginning of the step.
    pub state: ObjectState,
    /// Rigid bodies, each with its poses at the beginning and the end of the step.
    pub bodies: Vec<BodyMotion>,
    /// Surface triangles that can touch a body in this step, by their nodes in the model's order.
    pub triangles: Vec<[u32; 3]>,
    /// For each of these triangles the position in `bodies` of the body that it can touch.
    pub triangle_bodies: Vec<u32>,
    /// Nodes whose displacements are wanted.
    pub nodes: NodeChoice,
    /// Precision in which displacements travel.
    pub precision: Precision,
    /// Fields of strain, stress, energy and contact that are wanted beside the displacements.
    pub fields: FieldSet,
}

/// Length, physical constants and accuracy of one step.
///
/// Units: s, m/s², kg/m³, s; `…_rel` relative.
#[derive(Clone, Copy, Debug, PartialEq, SchemaRead, SchemaWrite)]
pub struct ContactAsk {
    /// Length of the step, s.
    pub seconds: f64,
    /// Acceleration of free fall, m/s², in the world frame.
    pub gravity: [f64; 3],
    /// Density of the object, kg/m³.
    pub density: f64,
    /// Time constant with which the shape forgets a force (Kelvin and Voigt), s; 0 for none.
    pub viscosity: f64,
    /// Accepted penetration, relative to the object's size.
    pub penetration_rel: f64,
    /// Accepted residual of the law of contact, relative to the largest force.
    pub residual_rel: f64,
    /// Most times that the contact problem is set up anew about the state where the last one ended.
    pub rounds_max: u32,
    /// Steps of Newton's method after which no further round is begun.
    pub newton_max: u32,
    /// Large deformation, or linear elasticity where it suffices; `None` for linear elasticity.
    pub deformation: Option<Deformation>,
    /// Energy of the material at large deformation.
    pub law: LawName,
    /// Stress above which the material flows and stays deformed, Pa; `None` for a material that never does.
    /// What has flowed is known to the session alone.
    pub yield_stress: Option<f64>,
    /// Whether the step goes on with the shape, the factor and the plastic strain of the session's last step
    /// at large deformation, or finds the shape by the forces of the state from rest on.
    pub path: PathChoice,
    /// Whether the small system of the step is wanted.
    pub small_system: bool,
    /// Time from the beginning of the request on after which the step ends at the best that was found, ms;
    /// `None` for as long as it takes.
    pub deadline_ms: Option<f64>,
}

/// Answer to `ContactFrame`.
#[derive(Clone, Debug, PartialEq)]
pub struct ContactAnswer {
    /// Displacements in the object's frame, without the rigid motion, and the report of the solve.
    pub answer: Answer,
    /// How well the answer meets the law of contact.
    pub contact: ContactReport,
    /// State of the object at the end of the step.
    pub state: ObjectState,
    /// Points of the object's surface that press on a body.
    pub points: Vec<ContactPoint>,
    /// Force and torque of each body on the object, in the order of the bodies.
    pub loads: Vec<BodyLoad>,
    /// How the forces of the bodies follow from their places, with as many contacts as the report says.
    pub small_system: SmallSystem,
}

/// How well the answer of a step meets the law of contact.
#[derive(Clone, Copy, Debug, Default, PartialEq, SchemaRead, SchemaWrite)]
pub struct ContactReport {
    /// Deepest point of the surface in a body, m.
    pub penetration_max: f64,
    /// Longest slip of a pressing point in this step, m.
    pub slip_max: f64,
    /// Largest residual of the natural map of Signorini's and Coulomb's law, N.
    pub residual: f64,
    /// Largest residual of the natural map over the largest force of a point.
    pub residual_rel: f64,
    /// Largest part of a force outside its cone of friction, N.
    pub cone_violation: f64,
    /// Whether penetration and residual are within what was asked for.
    pub is_converged: bool,
    /// Number of times that the contact problem was made.
    pub rounds: u32,
    /// Number of sweeps over all points.
    pub sweeps: u32,
    /// Number of steps of Newton's method.
    pub newton_steps: u32,
    /// Number of nodes whose columns of the compliance were computed for this step, by linear elasticity.
    pub columns_computed: u32,
    /// Whether the elastic part was solved at large deformation.
    pub is_large: bool,
    /// Number of shapes that contact was solved about, one after the other; 1 for linear elasticity.
    pub shapes: u32,
    /// Number of factors of the tangent that were made for this step.
    pub factors: u32,
    /// Largest accumulated plastic strain, 0 without a yield stress.
    pub plastic_strain: f64,
    /// Number of bodies of the small system; 0 where it was not asked for, or nothing presses.
    pub small_contacts: u32,
    /// Whether the step was ended by its deadline before it met what was asked for.
    pub is_late: bool,
}

/// A point of the object's surface that presses on a body.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ContactPoint {
    /// Position of the body in the request's list.
    pub body: u32,
    /// Whether the point slips along the body.
    pub slips: bool,
    /// Position of the point, m, in the world frame.
    pub place: [f64; 3],
    /// Unit normal out of the body, in the world frame.
    pub normal: [f64; 3],
    /// Force on the object, N, in the world frame.
    pub force: [f64; 3],
    /// Slip along the body in this step, m, in the world frame.
    pub slip: [f64; 3],
}

/// Sum of the forces of one body on the object.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct BodyLoad {
    /// Force on the object, N, in the world frame.
    pub force: [f64; 3],
    /// Torque about the position of the body's pose at the end of the step, N m, in the world frame.
    pub torque: [f64; 3],
    /// Sum of the normal components of the forces, N.
    pub normal_force: f64,
    /// Number of points that press on the body.
    pub contacts: u32,
}

#[derive(Clone, Debug, SchemaRead, SchemaWrite)]
struct ContactFramePart {
    model: ModelHash,
    ask: Block,
    state: Block,
    body_count: u32,
    triangle_count: u32,
    /// Whether the wanted nodes are listed; `false` means all nodes.
    listed: bool,
    node_count: u32,
    precision: Precision,
    fields: FieldSet,
}

#[derive(Clone, Debug, SchemaRead, SchemaWrite)]
struct ContactAnswerPart {
    answer: Block,
    contact: Block,
    state: Block,
    point_count: u32,
    load_count: u32,
}

const TRIANGLES: &str = "candidate triangles";
const NODES: &str = "wanted nodes";
const POINTS: &str = "contact points";
const LOADS: &str = "loads of bodies";
/// Numbers that a contact point takes in its array.
const POINT_NUMBERS: usize = 12;
const LOAD_NUMBERS: usize = 7;
/// Bytes of an option that is none.
const NO_DEADLINE: usize = 1;

impl Default for ContactAsk {
    /// A step of 10 ms by linear elasticity, with weight along −z and the density of water, as exact as a
    /// press asks for.
    fn default() -> Self {
        Self {
            seconds: 0.01,
            gravity: [0.0, 0.0, -9.81],
            density: 1000.0,
            viscosity: 0.0,
            penetration_rel: 1e-7,
            residual_rel: 1e-9,
            rounds_max: 40,
            newton_max: 1000,
            deformation: None,
            law: LawName::default(),
            yield_stress: None,
            path: PathChoice::Continue,
            small_system: false,
            deadline_ms: None,
        }
    }
}

impl ContactAsk {
    /// The fields; what is not asked for at their end is left out, as it was before there was any.
    fn block(&self) -> Result<Block, EncodeError> {
        let block = Block::of(self)?;
        Ok(match (self.small_system, self.deadline_ms) {
            (_, Some(_)) => block,
            (true, None) => block.without_last(NO_DEADLINE),
            (false, None) => block.without_last(size_of::<bool>() + NO_DEADLINE),
        })
    }
}

impl ContactReport {
    /// The fields with the number of bodies of a small system; what is 0 at their end is left out.
    fn block(&self, small_contacts: u32) -> Result<Block, EncodeError> {
        let block = Block::of(&Self { small_contacts, ..*self })?;
        Ok(match (small_contacts, self.is_late) {
            (_, true) => block,
            (1.., false) => block.without_last(size_of::<bool>()),
            (0, false) => block.without_last(size_of::<u32>() + size_of::<bool>()),
        })
    }
}

impl ContactFrame {
    pub(super) fn write(&self, writer: &mut PayloadWriter<'_>) -> Result<(), EncodeError> {
        let (count, expected) = (self.triangle_bodies.len(), self.triangles.len());
        if count != expected {
            let what = "bodies of candidate triangles";
            return Err(EncodeError::CountMismatch { what, count, expected });
        }
        let nodes: &[u32] = match &self.nodes {
            NodeChoice::All => &[],
            NodeChoice::Nodes(nodes) => nodes,
        };
        writer.part(&ContactFramePart {
            model: self.model,
            ask: self.ask.block()?,
            state: Block::of(&self.state.part()?)?,
            body_count: count_of_bodies(&self.bodies)?,
            triangle_count: count_of(TRIANGLES, expected)?,
            listed: matches!(self.nodes, NodeChoice::Nodes(_)),
            node_count: count_of(NODES, nodes.len())?,
            precision: self.precision,
            fields: self.fields,
        })?;
        self.state.write_arrays(writer);
        write_bodies(writer, &self.bodies)?;
        writer.array(self.triangles.as_flattened());
        writer.array(&self.triangle_bodies);
        writer.array(nodes);
        Ok(())
    }

    /// Trace that the request in a frame belongs to.
    pub(super) fn trace(frame: &Frame) -> Option<TraceContext> {
        let mut reader = PayloadReader::new(&frame.payload);
        let (_, later): (ContactFramePart, TracePart) = reader.part_and_later().ok()?;
        later.trace
    }

    pub(super) fn read(
        reader: &mut PayloadReader<'_>,
        limits: &Limits,
    ) -> Result<Self, DecodeError> {
        let part: ContactFramePart = reader.part()?;
        let state: ObjectStatePart = part.state.read()?;
        state.check(limits)?;
        check_bodies(part.body_count, limits)?;
        let triangle_count = check_count(TRIANGLES, part.triangle_count, limits.dof_count_max)?;
        let node_count = check_count(NODES, part.node_count, limits.node_count_max)?;
        let state = ObjectState::read_arrays(reader, state)?;
        let bodies = read_bodies(reader, part.body_count as usize, limits)?;
        let corners: Vec<u32> = reader.array(TRIANGLES, 3 * triangle_count)?;
        let triangle_bodies = reader.array("bodies of candidate triangles", triangle_count)?;
        let nodes = reader.array(NODES, node_count)?;
        Ok(Self {
            model: part.model,
            ask: part.ask.read()?,
            state,
            bodies,
            triangles: corners.as_chunks::<3>().0.to_vec(),
            triangle_bodies,
            nodes: if part.listed { NodeChoice::Nodes(nodes) } else { NodeChoice::All },
            precision: part.precision,
            fields: part.fields,
        })
    }
}

impl ContactAnswer {
    pub(super) fn write(&self, writer: &mut PayloadWriter<'_>) -> Result<(), EncodeError> {
        writer.part(&ContactAnswerPart {
            answer: Block::of(&self.answer.part()?)?,
            contact: self.contact.block(self.small_system.count()?)?,
            state: Block::of(&self.state.part()?)?,
            point_count: count_of(POINTS, self.points.len())?,
            load_count: count_of(LOADS, self.loads.len())?,
        })?;
        self.answer.write_arrays(writer);
        self.state.write_arrays(writer);
        let names: Vec<[u32; 2]> =
            self.points.iter().map(|point| [point.body, u32::from(point.slips)]).collect();
        writer.array(names.as_flattened());
        let numbers: Vec<[[f64; 3]; 4]> =
            self.points.iter().map(|p| [p.place, p.normal, p.force, p.slip]).collect();
        writer.array(numbers.as_flattened());
        let contacts: Vec<u32> = self.loads.iter().map(|load| load.contacts).collect();
        writer.array(&contacts);
        let numbers: Vec<f64> = self
            .loads
            .iter()
            .flat_map(|l| l.force.into_iter().chain(l.torque).chain([l.normal_force]))
            .collect();
        writer.array(&numbers);
        self.small_system.write_arrays(writer);
        Ok(())
    }

    pub(super) fn read(
        reader: &mut PayloadReader<'_>,
        limits: &Limits,
    ) -> Result<Self, DecodeError> {
        let part: ContactAnswerPart = reader.part()?;
        let answer: AnswerPart = part.answer.read()?;
        answer.check(limits)?;
        let state: ObjectStatePart = part.state.read()?;
        state.check(limits)?;
        let point_count = check_count(POINTS, part.point_count, limits.dof_count_max)?;
        let load_count = check_count(LOADS, part.load_count, limits.node_count_max)?;
        let answer = Answer::read_arrays(reader, answer, limits)?;
        let state = ObjectState::read_arrays(reader, state)?;
        let names: Vec<u32> = reader.array(POINTS, 2 * point_count)?;
        let numbers: Vec<f64> = reader.array(POINTS, POINT_NUMBERS * point_count)?;
        let contacts: Vec<u32> = reader.array(LOADS, load_count)?;
        let of_loads: Vec<f64> = reader.array(LOADS, LOAD_NUMBERS * load_count)?;
        let three = |numbers: &[f64], first: usize| -> [f64; 3] {
            std::array::from_fn(|k| numbers[first + k])
        };
        let points = names.as_chunks::<2>().0.iter().zip(numbers.chunks_exact(POINT_NUMBERS));
        let points = points.map(|(&[body, slips], n)| ContactPoint {
            body,
            slips: slips != 0,
            place: three(n, 0),
            normal: three(n, 3),
            force: three(n, 6),
            slip: three(n, 9),
        });
        let loads = contacts.iter().zip(of_loads.chunks_exact(LOAD_NUMBERS));
        let loads = loads.map(|(&contacts, n)| BodyLoad {
            force: three(n, 0),
            torque: three(n, 3),
            normal_force: n[6],
            contacts,
        });
        let (points, loads) = (points.collect(), loads.collect());
        let contact: ContactReport = part.contact.read()?;
        let small_system = SmallSystem::read_arrays(reader, contact.small_contacts)?;
        Ok(Self { answer, contact, state, points, loads, small_system })
    }
}
