//! The outcome of one tick: events, the state of the grasp, answers, and ticks without one.

use softgrasp_grasp::grasp::{GraspEvent, StateName};
use softgrasp_hand::notice::Notice;
use softgrasp_hand::scripted::Seen;
use softgrasp_hand::sent::Device;
use softgrasp_protocol::solve_report::SolveSummary;

use crate::ask::unanswered::Unanswered;
use crate::run::contact_ledger::StepRecord;

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
    /// What speaks, or is wrong with a device: it fell silent, speaks again, sends what it should not.
    Device(Notice),
}

impl LoopEvent {
    /// `grasp`, `shape` or `server`, and what happened in words.
    pub fn kind_and_words(&self) -> (&'static str, String) {
        match self {
            Self::Grasp(GraspEvent::TipTouched(finger, node)) => {
                ("grasp", format!("{finger} touched node {node}"))
            }
            Self::Grasp(event) => ("grasp", event.to_string()),
            Self::KeepRefused(text) => ("shape", format!("keep shape refused: {text}")),
            Self::Shape(text) => ("shape", text.clone()),
            Self::Server(text) => ("server", text.clone()),
            Self::Device(notice) => ("device", notice.text.clone()),
        }
    }
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
    /// Steps of a grasp by friction that were answered.
    pub steps: Vec<StepRecord>,
    /// Deforming ticks of which it is now certain that no answer comes, and why.
    pub unanswered: Vec<(u64, Unanswered)>,
    /// Tick whose answer the object shows now; `None` while it shows none of this grip.
    pub shown_tick: Option<u64>,
    /// Devices that are silent: the hand is held where it was.
    pub silent: Vec<Device>,
    /// Ticks among the answers whose path at large deformation began at rest.
    pub from_rest: Vec<u64>,
    /// Whether the answer to what the object springs back to was taken, or its refusal.
    pub sprung_back: bool,
    /// Whether there was no shape to spring back to.
    pub springback_refused: bool,
    /// Whether a rest shape that was made beside the ticks was taken.
    pub took_work: bool,
    /// Whether the step of a free object that had been asked for was given up.
    pub gave_up_step: bool,
    /// Digest of what the server is asked, where that is recorded or held against a recording.
    pub request_digest: Option<String>,
    /// What the person sees next.
    pub seen: Seen,
    /// Sentences for the person.
    pub notices: Vec<Notice>,
}

impl TickOutcome {
    /// Tells what was written to a file, or why nothing was.
    pub(crate) fn tell_saved(&mut self, saved: Result<String, String>) {
        let (notice, text) = match saved {
            Ok(text) => (Notice::done(text.clone()), text),
            Err(text) => (Notice::refused(text.clone()), text),
        };
        self.events.push(LoopEvent::Shape(text));
        self.notices.push(notice);
    }
}
