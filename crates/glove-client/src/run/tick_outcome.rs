//! Outcome of one tick: events, state of the grasp, answers, and ticks without one.

use softgrasp_grasp::grasp::{Command, GraspEvent, StateName};
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
    /// Event of a further object of the run.
    OfFurther {
        /// Number and name of the object.
        object: String,
        /// What happened.
        event: Box<LoopEvent>,
    },
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
            Self::OfFurther { object, event } => {
                let (kind, what) = event.kind_and_words();
                (kind, format!("{what} ({object})"))
            }
        }
    }

    /// Sentence for the person about the event, if it is worth one.
    pub(crate) fn notice(&self) -> Option<Notice> {
        Some(match self {
            Self::Grasp(GraspEvent::ShapeKept) => Notice::done("shape kept"),
            Self::Grasp(GraspEvent::Released) => Notice::done("the object is let go"),
            Self::Grasp(GraspEvent::ReturnedHome) => Notice::done("the object is back home"),
            Self::Grasp(GraspEvent::Ignored(Command::KeepShape)) => {
                Notice::refused("no shape to keep: close all five fingers on the object first")
            }
            Self::Grasp(GraspEvent::Ignored(command)) => {
                Notice::refused(format!("{command}: the hand holds nothing"))
            }
            Self::KeepRefused(text) => Notice::refused(text.clone()),
            Self::Device(notice) => notice.clone(),
            Self::OfFurther { object, event } => {
                let notice = event.notice()?;
                Notice { text: format!("{} ({object})", notice.text), ..notice }
            }
            Self::Grasp(_) | Self::Shape(_) | Self::Server(_) => return None,
        })
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
    /// Number of the object that a hand touched last, from 0.
    pub touched: usize,
    /// Outcomes of the further objects of the run, in their order; their news are among those above.
    pub further: Vec<TickOutcome>,
}

impl TickOutcome {
    /// Outcome of the object of a number, from 0; that of the first for a number that none has.
    pub fn part(&self, number: usize) -> &Self {
        number.checked_sub(1).and_then(|at| self.further.get(at)).unwrap_or(self)
    }

    /// What the tick showed, without its news.
    pub(crate) fn without_news(&self) -> Self {
        let &Self { state, tips, second_tips, recalled, shown_tick, seen, touched, .. } = self;
        Self {
            state,
            tips,
            second_tips,
            recalled,
            shown_tick,
            seen,
            touched,
            further: self.further.iter().map(Self::without_news).collect(),
            ..Self::default()
        }
    }

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
