//! The messages of the link to the ticks: news about the server, and the end of each request.

use std::time::Duration;

use softgrasp_protocol::{
    BodyLoad, ContactReport, DofValue, LargeReport, ModelReady, NodeChoice, ObjectState,
    SolveReport,
};

use crate::ask::unanswered::Unanswered;

/// News about the server.
#[derive(Debug)]
pub enum LinkEvent {
    /// Connected, or connected again.
    Connected {
        /// Name and version of the server.
        server: String,
    },
    /// The server has the model.
    ModelReady(ModelReady),
    /// The server refused the model or a request; told once, until something changes.
    Refused {
        /// What was refused and why, in one short line.
        text: String,
    },
    /// The connection is lost; it is tried again.
    Lost {
        /// Why.
        text: String,
    },
}

/// How the request of one tick ended. Every request that the link was given ends exactly once.
#[derive(Debug)]
pub struct RequestEnd {
    /// Tick the request was made in.
    pub tick: u64,
    /// The answer, or why there is none.
    pub reached: Result<Box<Reached>, Unanswered>,
}

/// The server's answer to the request of a tick.
#[derive(Debug)]
pub struct Reached {
    /// Which rest shape it belongs to.
    pub rest_shape: u64,
    /// Nodes that `displacement` belongs to.
    pub nodes: NodeChoice,
    /// Displacement of these nodes, m.
    pub displacement: Vec<[f64; 3]>,
    /// Forces at the known degrees of freedom, N; empty if not asked for.
    pub reactions: Vec<DofValue>,
    /// Force of each mask, N, in the order of the question; empty if not asked for.
    pub mask_forces: Vec<[f64; 3]>,
    /// What it cost and how wrong it can be.
    pub report: Box<SolveReport>,
    /// What is reported of large deformation; `None` for an answer to a linear question.
    pub large: Option<LargeReport>,
    /// Whether its path at large deformation began at rest, and not where the answer before ended.
    pub from_rest: bool,
    /// What is answered to a step of a free object among rigid bodies; `None` for an answer to
    /// prescribed displacements.
    pub step: Option<ReachedStep>,
    /// From sending to having the answer.
    pub round_trip: Duration,
    /// Bytes of request and answer.
    pub bytes: [u64; 2],
}

/// The part of an answer that only a step of a free object has.
#[derive(Debug)]
pub struct ReachedStep {
    /// How well the law of contact is met.
    pub contact: ContactReport,
    /// The object at the end of the step.
    pub state: ObjectState,
    /// What each body does to the object, in the order of the bodies asked about.
    pub loads: Vec<BodyLoad>,
}
