//! Outcome of one tick: events, state of the grasp, answers, and ticks without one.

use softgrasp_grasp::grasp::{GraspEvent, StateName};
use softgrasp_hand::notice::Notice;
use softgrasp_hand::scripted::Seen;
use softgrasp_hand::sent::SilentDevice;
use softgrasp_protocol::solve_report::SolveSummary;

use crate::ask::unanswered::Unanswered;
use crate::run::contact_ledger::StepRecord;

/// Event of a tick, for the report; in the order of occurrence.
#[derive(Clone, Debug, PartialEq)]
pub enum LoopEvent {
    /// The state of the grasp changed.
    Grasp(GraspEvent),
    /// A shape that was to be kept cannot be kept.
    KeepRefused(String),
    /// The object was changed, replaced or saved.
    Shape(String),
    /// The server was connected, lost, or refused.
    Server(String),
    /// News of a device: it fell silent, speaks again, or sends bad records.
    Device(Notice),
}

impl LoopEvent {
    /// Kind of the event (`grasp`, `shape` or `server`), and what happened in words.
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

/// Outcome of one tick, for the status line and the report.
#[derive(Clone, Debug, Default)]
pub struct TickOutcome {
    /// Events of this tick.
    pub events: Vec<LoopEvent>,
    /// State of the grasp after the tick; `None` until both devices have sent samples.
    pub state: Option<StateName>,
    /// Whether each fingertip holds or touches, thumb first.
    pub tips: [bool; 5],
    /// Whether each fingertip of the second hand touches, thumb first.
    pub second_tips: [bool; 5],
    /// Number of segments shown at their last free pose, for each finger.
    pub recalled: [u8; 5],
    /// Answers that came, each with the tick that had asked.
    pub answers: Vec<(u64, SolveSummary)>,
    /// Steps of a grasp by friction that were answered.
    pub steps: Vec<StepRecord>,
    /// Deforming ticks that will certainly have no answer, each with the reason.
    pub unanswered: Vec<(u64, Unanswered)>,
    /// Tick whose answer the object shows now; `None` if it shows none of this grip.
    pub shown_tick: Option<u64>,
    /// Devices that are silent, so that the hand keeps its pose.
    pub silent: Vec<SilentDevice>,
    /// Ticks among the answers whose path at large deformation began at rest.
    pub from_rest: Vec<u64>,
    /// Whether the tick took the answer about springing back, or its refusal.
    pub sprung_back: bool,
    /// Whether there was no shape to spring back to.
    pub springback_refused: bool,
    /// Whether the tick took a rest shape that was made in the background.
    pub took_work: bool,
    /// Whether an awaited step of a free object was given up.
    pub gave_up_step: bool,
    /// Digest of the tick's question, if it is recorded or compared with a recording.
    pub request_digest: Option<String>,
    /// Visible result of the tick for the person.
    pub seen: Seen,
    /// The same for the person behind the second hand.
    pub seen_by_second: Seen,
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
