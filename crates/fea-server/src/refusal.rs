//! The reasons for which a request is refused, and the message that tells the client.

use softgrasp_core::dynamics::StepError;
use softgrasp_core::fem::MaterialError;
use softgrasp_core::gradient::NoGradient;
use softgrasp_core::mesh::MeshError;
use softgrasp_core::model::ModelError;
use softgrasp_core::solve::condensed::CondensedError;
use softgrasp_core::solve::equilibrium::{NoAdjoint, NoEquilibrium};
use softgrasp_core::solve::{Method, SolveError, UnknownMethod};
use softgrasp_protocol::{DecodeError, Field, ModelHash, RejectCode, Rejected, VERSION};

use crate::engine::ClusterMethod;
use crate::no_room::NoRoom;
use crate::plan::PlanError;
use crate::workers::EndedAbnormally;

/// Reason for which a request is refused, before it becomes a message.
#[derive(Debug, thiserror::Error)]
pub(crate) enum Refusal {
    #[error("the request cannot be decoded: {0}")]
    Decode(DecodeError),
    #[error("the request is too large for this server: {0} (--max-nodes sets most limits)")]
    Limit(DecodeError),
    #[error("the mesh cannot be modelled: {0}")]
    Mesh(#[from] MeshError),
    #[error(transparent)]
    Material(#[from] MaterialError),
    #[error(transparent)]
    Model(#[from] ModelError),
    #[error(transparent)]
    Method(#[from] UnknownMethod),
    #[error(transparent)]
    Plan(#[from] PlanError),
    #[error(
        "several cases are solved with a factor; the method condensed and masks have none: ask for \
         one case at a time"
    )]
    SeveralCondensed,
    #[error(
        "{cases} cases take {bytes} bytes beside the factor, {free} are free (--memory-limit); ask \
         for fewer at a time"
    )]
    TooManyCases { cases: usize, bytes: u64, free: u64 },
    #[error(
        "several cases are answered by linear elasticity; ask for one case at a time at large \
         deformation"
    )]
    SeveralLarge,
    #[error("{field} belong to contact frames; other questions have forces at masks and reactions")]
    ContactFields { field: Field },
    #[error(
        "the fields asked for take {bytes} bytes, {free} are free (--memory-limit); ask for fewer of \
         them, or for those of fewer nodes"
    )]
    FieldsMemory { bytes: u64, free: u64 },
    #[error(
        "the fields asked for are {bytes} bytes long, an answer holds {most} bytes of fields; ask for \
         fewer of them at a time, or for those of nodes only"
    )]
    FieldsTooLarge { bytes: u64, most: u64 },
    #[error("a question about large deformation asks for linear elasticity: leave `large` out")]
    LargeLinear,
    #[error("the request was cancelled by its client")]
    Cancelled,
    #[error("a newer request for the same model came before this one was begun")]
    Superseded,
    #[error(
        "the client speaks versions {lowest} to {highest} of the wire, this server speaks \
         {VERSION}; bring the older one up to date"
    )]
    NoCommonVersion { lowest: u16, highest: u16 },
    #[error("no material was given")]
    NoMaterial,
    #[error(
        "{materials} materials were given for {labels} region labels; give one material for the \
         whole body, or one for each label in ascending order of the labels"
    )]
    Regions { labels: usize, materials: usize },
    #[error("no model {0} is known here; upload it")]
    UnknownModel(ModelHash),
    #[error(
        "{what} names node {node}, but the mesh has {node_count} nodes (0-based); name nodes \
         below {node_count}"
    )]
    NoSuchNode { what: &'static str, node: u32, node_count: usize },
    #[error("a force at node {node} is {value} N; it must be a finite number")]
    ForceNotFinite { node: u32, value: f64 },
    #[error("a force acts on node {node} along an axis whose displacement is known")]
    ForceOnKnown { node: u32 },
    #[error("{what} is {value}; it must be a finite number above 0, or be left out")]
    Wish { what: &'static str, value: f64 },
    #[error("mask {mask} (from 0) is given the displacement {value} m; it must be a finite number")]
    MaskNotFinite { mask: usize, value: f64 },
    #[error(
        "{forces} forces are unknown at masks and touched nodes, at most {max} can be with masks; \
         hold nodes that never move by fixing them in the model"
    )]
    TooManyTouched { forces: usize, max: usize },
    #[error("the mesh has {node_count} nodes; this server takes {max} (--max-nodes)")]
    TooManyNodes { node_count: usize, max: u32 },
    #[error(
        "{method}: no digit of the answer would be certain (estimated error {error_rel:.0e} of the \
         largest displacement, condition {condition:.0e}): what is known holds the body too weakly, \
         or the material is too near to incompressible; hold nodes further apart and not in line, or \
         lower Poisson's ratio"
    )]
    Uncertain { method: String, error_rel: f64, condition: f64 },
    #[error(transparent)]
    NoEquilibrium(#[from] NoEquilibrium),
    #[error(transparent)]
    Gradient(#[from] NoGradient),
    #[error(
        "derivatives are solved for with a factor; the method condensed and masks have none: ask with auto \
         or front, and prescribe displacements of nodes"
    )]
    GradientCondensed,
    #[error("derivatives are those of one case; ask for one case at a time")]
    SeveralGradients,
    #[error(
        "the tangent for derivatives takes {bytes} bytes, {free} are free (--memory-limit); ask without \
         them"
    )]
    GradientMemory { bytes: u64, free: u64 },
    #[error(
        "large deformation is solved by newton with a factor of front or front-mixed, by multigrid in a \
         request with a mesh of its own, or auto; {method} cannot"
    )]
    LargeMethod { method: Method },
    #[error("rigid body {body} (from 0): {reason}")]
    Body { body: usize, reason: String },
    #[error("the object's pose: {reason}")]
    ObjectPose { reason: &'static str },
    #[error("contact frame: {0}")]
    Step(StepError),
    #[error("a yield stress is {value} Pa; it must be a finite number above 0, or be left out")]
    Yield { value: f64 },
    #[error("this server wants a token (--token-file); say Hello with the right one first")]
    Token,
    #[error(
        "too many wrong tokens from this address; try again {seconds} s after the last of them"
    )]
    Barred { seconds: u64 },
    #[error(transparent)]
    NoRoom(#[from] NoRoom),
    #[error("{}", .0.text)]
    Elsewhere(Rejected),
    #[error(
        "{method} is answered by a cluster, for questions about a mesh that comes along and models \
         that are too large for this server; start it with --cluster HOST:PORT"
    )]
    NoCluster { method: ClusterMethod },
    #[error("{what} cannot be answered by a cluster: {instead}")]
    NotByCluster { what: &'static str, instead: &'static str },
    #[error(
        "the answer is not finite: displacements, forces or sizes of this request are out of \
         the range of double precision; scale them, for example to metres and pascals"
    )]
    NotFinite,
    #[error("the server is at fault: the work on this request ended abnormally")]
    Internal,
}

/// Time in ms after which to ask again if memory was missing only at the moment.
const NO_ROOM_MS: u32 = 1000;

impl From<DecodeError> for Refusal {
    fn from(error: DecodeError) -> Self {
        match error {
            DecodeError::TooMany { .. } => Self::Limit(error),
            _ => Self::Decode(error),
        }
    }
}

impl From<StepError> for Refusal {
    fn from(error: StepError) -> Self {
        match error {
            StepError::Elastic(error) => Self::Model(ModelError::Condensed(error)),
            error => Self::Step(error),
        }
    }
}

impl From<EndedAbnormally> for Refusal {
    fn from(_: EndedAbnormally) -> Self {
        Self::Internal
    }
}

impl Refusal {
    /// Code of the refusal, for the client's program.
    pub fn code(&self) -> RejectCode {
        match self {
            Self::UnknownModel(_) => RejectCode::UnknownModel,
            Self::Model(error) | Self::Gradient(NoGradient::Model(error)) => code_of_model(error),
            Self::Gradient(NoGradient::Adjoint(error)) => code_of_adjoint(error),
            Self::Plan(error) => code_of_plan(error),
            Self::Method(_) => RejectCode::UnknownMethod,
            Self::TooManyNodes { .. } => RejectCode::TooLarge,
            Self::TooManyCases { .. }
            | Self::FieldsMemory { .. }
            | Self::GradientMemory { .. }
            | Self::NoRoom(_) => RejectCode::MemoryLimit,
            Self::FieldsTooLarge { .. } => RejectCode::TooLarge,
            Self::Uncertain { .. } | Self::NoEquilibrium(_) => RejectCode::Uncertain,
            Self::Token | Self::Barred { .. } => RejectCode::NotAuthorised,
            Self::Internal => RejectCode::Internal,
            Self::Limit(_) => RejectCode::TooLarge,
            Self::Cancelled => RejectCode::Cancelled,
            Self::Superseded => RejectCode::Superseded,
            Self::Elsewhere(rejected) => rejected.code,
            Self::NoCluster { .. } => RejectCode::UnknownMethod,
            Self::NoCommonVersion { .. } => RejectCode::UnsupportedVersion,
            _ => RejectCode::BadRequest,
        }
    }

    /// Message that tells the client of the refusal.
    pub fn to_message(&self) -> Rejected {
        let detail = match self {
            Self::Plan(PlanError::Memory(shortage)) => shortage.detail(),
            Self::Elsewhere(rejected) => rejected.detail.clone(),
            _ => String::new(),
        };
        let retry_after_ms = match self {
            Self::Barred { seconds } => u32::try_from(1000 * seconds).unwrap_or(u32::MAX),
            Self::NoRoom(NoRoom::Now { .. }) => NO_ROOM_MS,
            Self::Elsewhere(rejected) => rejected.retry_after_ms,
            _ => 0,
        };
        Rejected { code: self.code(), text: self.to_string(), detail, retry_after_ms }
    }
}

fn code_of_adjoint(error: &NoAdjoint) -> RejectCode {
    match error {
        NoAdjoint::Plastic | NoAdjoint::Masks => RejectCode::BadRequest,
        NoAdjoint::OutOfMemory { .. } => RejectCode::MemoryLimit,
        NoAdjoint::NotConverged { .. } | NoAdjoint::Snapped | NoAdjoint::NotStable => {
            RejectCode::Uncertain
        }
    }
}

fn code_of_plan(error: &PlanError) -> RejectCode {
    match error {
        PlanError::MasksNotCondensed(reason) => code_of_plan(reason),
        PlanError::Memory(_) => RejectCode::MemoryLimit,
        PlanError::Model(error) => code_of_model(error),
        PlanError::FixedMoved { .. } | PlanError::MasksDirect { .. } => RejectCode::BadRequest,
    }
}

fn code_of_model(error: &ModelError) -> RejectCode {
    match error {
        ModelError::Free(_) => RejectCode::RigidMotionFree,
        ModelError::Solve(error) => match error {
            SolveError::NotPositiveDefinite { .. } => RejectCode::NotPositiveDefinite,
            SolveError::NotConverged { .. } => RejectCode::Uncertain,
            SolveError::OutOfMemory { .. } | SolveError::OverLimit { .. } => {
                RejectCode::MemoryLimit
            }
            _ => RejectCode::BadRequest,
        },
        ModelError::Condensed(error) => match error {
            CondensedError::NotHeld => RejectCode::RigidMotionFree,
            CondensedError::HeldTooWeakly { .. } => RejectCode::Uncertain,
            CondensedError::NotPositiveDefinite { .. } => RejectCode::NotPositiveDefinite,
            CondensedError::OutOfMemory { .. }
            | CondensedError::OverLimit { .. }
            | CondensedError::CacheTooSmall { .. } => RejectCode::MemoryLimit,
            _ => RejectCode::BadRequest,
        },
        _ => RejectCode::BadRequest,
    }
}
