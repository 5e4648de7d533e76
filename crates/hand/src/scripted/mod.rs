//! The scripted hand: plays a person who looks, reaches, grasps and squeezes, as device bytes.

mod approach;
mod grasp_plan;
mod hand;
mod lay;
mod opposed;
mod pinch;
mod plan;
mod planner;
mod posture;
mod rehearsal;
mod script;
mod seen;
mod tip_paths;

pub use approach::PalmPath;
pub use grasp_plan::GraspPlan;
pub use hand::{GRIP_MARGIN, ScriptedHand};
pub use plan::{GraspWish, plan_grasp};
pub use planner::{NoGrasp, PlanRequest, Planner};
pub use posture::{Posture, angles};
pub use rehearsal::Rehearsal;
pub use script::{ScriptName, UnknownScript};
pub use seen::Seen;
