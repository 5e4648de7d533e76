//! Typed messages: what the client asks and what the server answers.

mod answer;
mod ask;
mod contact;
mod dof_value;
mod fields;
mod gradient;
mod large;
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
mod small_system;
mod spread_loads;

pub use answer::{Answer, CaseAnswer, Displacements};
pub use ask::{Ask, Body, Subject};
pub use contact::{BodyLoad, ContactAnswer, ContactAsk, ContactFrame, ContactPoint, ContactReport};
pub use dof_value::DofValue;
pub use fields::{Field, FieldPlace, FieldSet, FieldValues};
pub use gradient::{GradientValues, Quantity, QuantityTerm};
pub use large::{
    Deformation, DeformationError, LargeAsk, LargeReport, LawName, LawNameError, Pace, PathChoice,
};
pub use masks::Masks;
pub use mesh::{Material, MeshData};
pub use model::{ModelHash, ModelHashError, ModelReady, Prefetch, UploadModel};
pub use names::{
    ElementChoice, ElementChoiceError, ElementName, ElementUsed, MethodName, MethodNameError,
};
pub use object_state::{HeldContact, ObjectState};
pub use question::{NodeChoice, Precision, Question, Want};
pub use reject::{RejectCode, Rejected};
pub use reply::Reply;
pub use report::{ReportLevel, SolveReport, StageMs, Warning, WarningCode, WarningLevel};
pub use request::Request;
pub use rigid_body::{BodyMotion, BodyShape, Pose};
pub use session::{Hello, Welcome};
pub use small_system::{BodyContact, SmallSystem};
pub use spread_loads::{SpreadLoads, SurfacePressure};
