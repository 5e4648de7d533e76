//! Grasp rules (thesis 4.5–4.6) as a pure state machine.

mod event;
mod rules;
#[cfg(test)]
mod scene_tests;
mod sense;
mod state;
mod step;
mod table;
#[cfg(test)]
mod tests;

pub use event::{Command, GraspEvent, KnownNode, StepInput, StepOutput};
pub use sense::{FingerInput, sense};
pub use state::{Contact, GraspState, HandSegments, Hold, StateName};
pub use step::{Grasp, GraspError};
pub use table::transition_table;
