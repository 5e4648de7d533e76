//! The outcome of one tick: events, the state of the grasp, answers, and ticks without one.

use softgrasp_core::grasp::{GraspEvent, StateName};

use crate::notice::Notice;
use crate::scripted::Seen;
use crate::solve_report::SolveSummary;
use crate::unanswered::Unanswered;

/// What happened, for the report; in the order it happened.
#[derive(Clone, Debug, PartialEq)]
pub enum LoopEvent {
    /// The grasp changed.
    Grasp(GraspEvent),
    /// A shape was to be kept, but cannot be.
    KeepRefused(String),
    /// The object was changed, replaced or saved.
    Shape(String),
    /// The server came, went, or refused.
    Server(String),
}

/// One tick, for the status line and the report.
#[derive(Clone, Debug, Default)]
pub struct TickOutcome {
    /// Events of this tick.
    pub events: Vec<LoopEvent>,
    /// State after it; `None` until both devices have spoken.
    pub state: Option<StateName>,
    /// Which tips hold or touch, thumb first.
    pub tips: [bool; 5],
    /// Segments shown at their last free pose, by finger.
    pub recalled: [u8; 5],
    /// Answers that came, with the tick they were asked for in.
    pub answers: Vec<(u64, SolveSummary)>,
    /// Deforming ticks of which it is now certain that no answer comes, and why.
    pub unanswered: Vec<(u64, Unanswered)>,
    /// Tick whose answer the object shows now; `None` while it shows none of this grip.
    pub shown_tick: Option<u64>,
    /// What the person sees next.
    pub seen: Seen,
    /// Sentences for the person.
    pub notices: Vec<Notice>,
}
