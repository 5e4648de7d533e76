//! The messages of the link to the ticks: news about the server, and the end of each request.

use std::time::Duration;

use softgrasp_protocol::{
    BodyLoad, ContactReport, DofValue, LargeReport, ModelReady, NodeChoice, ObjectState,
    SmallSystem, SolveReport,
};

use crate::ask::unanswered::Unanswered;

/// News about the server.
#[derive(Debug)]
pub enum LinkEvent {
    /// The server is connected, or connected again.
    Connected {
        /// Name and version of the server.
        server: String,
    },
    /// The server keeps the model.
    ModelReady(ModelReady),
    /// The server has refused the model or a request; told once, until something changes.
    Refused {
        /// Subject and reason of the refusal, in one short line.
        text: String,
    },
    /// The connection is lost; the link tries to connect again.
    Lost {
        /// Reason of the loss.
        text: String,
    },
}

/// End of a tick's request. Every request that the link was given ends exactly once.
#[derive(Debug)]
pub struct RequestEnd {
    /// Tick that made the request.
    pub tick: u64,
    /// The answer, or why there is none.
    pub reached: Result<Box<Reached>, Unanswered>,
}

/// Answer of the server to a tick's request.
#[derive(Debug)]
pub struct Reached {
    /// Number of the rest shape that the answer belongs to.
    pub rest_shape: u64,
    /// Nodes that `displacement` belongs to.
    pub nodes: NodeChoice,
    /// Displacements of these nodes, m, in the object's frame.
    pub displacement: Vec<[f64; 3]>,
    /// Reaction forces at the known degrees of freedom, N; empty if not asked for.
    pub reactions: Vec<DofValue>,
    /// Force of each mask, N, in the order of the question; empty if not asked for.
    pub mask_forces: Vec<[f64; 3]>,
    /// Times of the stages, residual and error bound.
    pub report: Box<SolveReport>,
    /// Report of large deformation; `None` for an answer to a linear question.
    pub large: Option<LargeReport>,
    /// Whether the path at large deformation began at rest, not at the end of the answer before.
    pub from_rest: bool,
    /// Result of a step of a free object among rigid bodies; `None` for an answer to prescribed
    /// displacements.
    pub step: Option<ReachedStep>,
    /// Time from sending the request to having the answer.
    pub round_trip: Duration,
    /// Lengths of request and answer on the wire, bytes.
    pub bytes: [u64; 2],
}

/// Part of an answer that only a step of a free object has.
#[derive(Debug)]
pub struct ReachedStep {
    /// How well the answer meets the law of contact.
    pub contact: ContactReport,
    /// State of the object at the end of the step.
    pub state: ObjectState,
    /// Force and torque of each body on the object, in the order of the request.
    pub loads: Vec<BodyLoad>,
    /// How the forces of the bodies follow from their places; empty if not asked for.
    pub small_system: SmallSystem,
}
