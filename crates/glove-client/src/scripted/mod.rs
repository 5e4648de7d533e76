//! The scripted hand: plays a person who looks, reaches, grasps and squeezes, as device bytes.

mod approach;
mod plan;
mod script;

pub use approach::PalmPath;
pub use plan::{GraspPlan, Posture, angles, plan_grasp};
pub use script::{NoGrasp, ScriptName, ScriptedHand, Seen, Sent, UnknownScript};
