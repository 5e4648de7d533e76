//! Typed messages: what the client asks and what the server answers.

mod answer;
mod contact;
mod dof_value;
mod large;
mod large_ask;
mod masks;
mod mesh;
mod model;
mod names;
mod object_state;
mod question;
mod reject;
mod reply;
mod report;
mod request;
mod rigid_body;
mod session;
mod several;

pub use answer::{Answer, Displacements};
pub use contact::{BodyLoad, ContactAnswer, ContactAsk, ContactFrame, ContactPoint, ContactReport};
pub use dof_value::DofValue;
pub use large::{DeformationName, LargeAnswer, LargeFrame, LargeReport, SolveLarge};
pub use large_ask::{
    DeformationChoice, DeformationChoiceError, LargeAsk, LawName, LawNameError, Pace, PathChoice,
};
pub use masks::Masks;
pub use mesh::{Material, MeshData};
pub use model::{FrameRequest, ModelHash, ModelHashError, ModelReady, Prefetch, UploadModel};
pub use names::{ElementChoice, ElementChoiceError, ElementName, MethodName, MethodNameError};
pub use object_state::{HeldContact, ObjectState};
pub use question::{NodeChoice, Precision, Question, SolveOnce, Want};
pub use reject::{RejectCode, Rejected};
pub use reply::Reply;
pub use report::{SolveReport, StageMs, WarningLevel};
pub use request::Request;
pub use rigid_body::{BodyMotion, BodyShape, Pose};
pub use session::{Hello, Welcome};
pub use several::{CaseAnswer, SeveralAnswers, SolveSeveral};
