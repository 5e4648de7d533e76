//! A hand that repeats a recording.

use std::sync::Arc;

use softgrasp_grasp::grasp::Command;

use super::read::Recording;
use super::replay_check::ReplayCheck;
use super::stages::StageDigests;
use super::tick::{Intervention, RecordedTick};
use crate::sent::{RecordedAnswers, Sent};

/// Plays the ticks of a recording one after another, however fast it is asked.
pub struct ReplayHand {
    recording: Arc<Recording>,
    name: String,
    next: usize,
    /// Comparison of what the replayed ticks made with what was recorded.
    pub check: ReplayCheck,
}

/// A tick that is played again.
pub struct Replayed {
    /// Number of the tick.
    pub tick: u64,
    /// Number of ticks before it that were not played.
    pub skipped: u64,
    /// Time of the tick on the client's clock when it was recorded, s.
    pub now_s: f64,
    /// What a person did to the object before the tick.
    pub interventions: Vec<Intervention>,
    /// Bytes that the devices sent, and the command.
    pub sent: Sent,
}

impl ReplayHand {
    /// A hand that repeats a recording from its beginning; `name` is its file.
    pub fn new(recording: Arc<Recording>, name: String) -> Self {
        Self { recording, name, next: 0, check: ReplayCheck::default() }
    }

    /// Path of the recording's file.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// The recording that is played.
    pub fn recording(&self) -> &Recording {
        &self.recording
    }

    /// The next tick; `None` when the recording is over.
    pub fn next_tick(&mut self) -> Option<Replayed> {
        let recorded = self.recording.ticks.get(self.next)?;
        let RecordedTick { seen, arrivals, answered_by, from_rest, springback_refused } = recorded;
        self.next += 1;
        let recorded = RecordedAnswers {
            answered_by: answered_by.clone(),
            from_rest: *from_rest,
            springback_refused: *springback_refused,
            taken: seen.answers.clone(),
            took_work: seen.took_work,
            // Who asks for a step waits for no other.
            gives_up_step: seen.gave_up_step || !seen.stages.request.is_empty(),
        };
        let sent = Sent {
            arrivals: arrivals.clone(),
            command: seen.command.as_deref().and_then(command),
            over: false,
            recorded: Some(recorded),
        };
        Some(Replayed {
            tick: seen.tick,
            skipped: seen.skipped,
            now_s: seen.now_s,
            interventions: seen.interventions.clone(),
            sent,
        })
    }

    /// Compares what the tick that was played last has made with the recording.
    pub fn compare(&mut self, made: &StageDigests) {
        let last = self.next.checked_sub(1).and_then(|at| self.recording.ticks.get(at));
        if let Some(recorded) = last {
            self.check.add(&recorded.seen, made);
        }
    }
}

/// The command of this name, if there is one.
fn command(name: &str) -> Option<Command> {
    [Command::KeepShape, Command::Release, Command::ReturnHome]
        .into_iter()
        .find(|command| command.to_string() == name)
}
