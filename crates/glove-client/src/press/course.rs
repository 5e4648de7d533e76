//! Plays a press: one contact frame after the other, from the beginning to the end.

use std::time::Instant;

use softgrasp_core::dynamics::MovingBody;
use softgrasp_core::mesh::{Surface, TetMesh};
use softgrasp_protocol::{
    ContactAnswer, ContactAsk, ContactFrame, FieldSet, ModelHash, NodeChoice, ObjectState, Reply,
    Request,
};

use super::bodies_file::{PressBodies, PressBody};
use crate::ask::connection::{LinkError, ServerConnection, unexpected};
use crate::ask::contact_frame::{StepBody, StepObject};

/// Press with all that its steps need.
pub struct Course<'a> {
    /// Object at rest.
    pub mesh: &'a TetMesh,
    /// Boundary surface of the object.
    pub surface: &'a Surface,
    /// Name of the kept model.
    pub model: ModelHash,
    /// Bodies, and the time at which the press ends.
    pub bodies: &'a PressBodies,
    /// Coefficient of friction of bodies that name none.
    pub friction: f64,
    /// Settings of each step; `seconds` is the longest step.
    pub ask: ContactAsk,
    /// Whether the displacements of all nodes are wanted in every step.
    pub whole: bool,
    /// Fields that are wanted in every step, and in the last one.
    pub fields: FieldSet,
}

/// One step with its answer.
pub struct Step {
    /// Time at the end of the step, s.
    pub time: f64,
    /// Answer of the server.
    pub answer: ContactAnswer,
    /// Displacement of every node in the object's frame, m; zero inside unless all are wanted.
    pub displacement: Vec<[f64; 3]>,
    /// Time from sending the request to having the answer, ms.
    pub ms: f64,
}

impl Course<'_> {
    /// Makes all steps and passes each to `seen`.
    ///
    /// # Errors
    /// [`LinkError`], or an error of `seen`.
    pub fn play<E: From<LinkError>>(
        &self,
        connection: &mut ServerConnection,
        mut seen: impl FnMut(Step) -> Result<(), E>,
    ) -> Result<(), E> {
        let node_count = self.mesh.node_count();
        let mut state = ObjectState::at_rest([0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0]);
        let mut displacement = vec![[0.0; 3]; node_count];
        let mut time = 0.0;
        let steps = (self.bodies.end / self.ask.seconds).ceil().max(1.0) as usize;
        for step in 1..=steps {
            let next = self.bodies.end * step as f64 / steps as f64;
            // In the last step all nodes are wanted.
            let (nodes, fields) = match self.whole || step == steps {
                true => (NodeChoice::All, self.fields),
                false => (NodeChoice::Nodes(self.surface.nodes.clone()), FieldSet::NONE),
            };
            let object = StepObject {
                model: self.model,
                vertices: self.mesh.vertices(),
                triangles: &self.surface.triangles,
                displacement: &displacement,
                nodes,
            };
            let bodies: Vec<StepBody> =
                self.bodies.bodies.iter().map(|body| self.body(body, time, next)).collect();
            let ask = ContactAsk { seconds: next - time, ..self.ask };
            let frame = ContactFrame { fields, ..object.frame(state, &bodies, ask) };
            let start = Instant::now();
            let mut answer = match connection.ask(&Request::ContactFrame(Box::new(frame)))? {
                Reply::ContactAnswer(answer) => *answer,
                other => return Err(unexpected("ContactFrame", &other).into()),
            };
            let ms = start.elapsed().as_secs_f64() * 1e3;
            displacement = self.spread(&mut answer);
            state = answer.state.clone();
            time = next;
            seen(Step { time, answer, displacement: displacement.clone(), ms })?;
        }
        Ok(())
    }

    fn body(&self, body: &PressBody, from: f64, to: f64) -> StepBody {
        let moving = MovingBody {
            shape: body.shape.clone(),
            world_from_body_start: body.way.at(from),
            world_from_body_end: body.way.at(to),
            friction: body.friction.unwrap_or(self.friction),
            compliance: body.compliance,
        };
        StepBody { moving, shape: body.on_the_wire.clone() }
    }

    /// Displacement of every node, from the displacements in an answer.
    fn spread(&self, answer: &mut ContactAnswer) -> Vec<[f64; 3]> {
        let empty = softgrasp_protocol::Displacements::F64(Vec::new());
        let values = std::mem::replace(&mut answer.answer.displacements, empty).into_f64();
        match &answer.answer.nodes {
            NodeChoice::All => values,
            NodeChoice::Nodes(nodes) => {
                let mut all = vec![[0.0; 3]; self.mesh.node_count()];
                for (&node, value) in nodes.iter().zip(values) {
                    all[node as usize] = value;
                }
                all
            }
        }
    }
}
