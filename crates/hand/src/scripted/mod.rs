//! The scripted hand: plays a person who looks, reaches, grasps and squeezes, as device bytes.

mod approach;
mod hand;
mod plan;
mod planner;
mod rehearsal;
mod script;

pub use approach::PalmPath;
pub use hand::{ScriptedHand, Seen};
pub use plan::{GraspPlan, Posture, angles, plan_grasp};
pub use planner::{NoGrasp, PlanRequest, Planner};
pub use rehearsal::Rehearsal;
pub use script::{ScriptName, UnknownScript};
