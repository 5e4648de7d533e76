//! What a replay made, held against what was recorded.

use std::fmt;

use serde::Serialize;

use super::stages::{Stage, StageDigests};
use super::tick::TickSeen;

/// How far a replay agrees with its recording.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ReplayCheck {
    /// Number of ticks that were compared.
    pub ticks: u64,
    /// Number of these ticks that had known displacements.
    pub requests: u64,
    /// First difference between the replay and its recording.
    pub difference: Option<Difference>,
}

/// First tick and stage in which a replay differs from its recording.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Difference {
    /// Number of the tick.
    pub tick: u64,
    /// Name of the stage of the tick.
    pub stage: String,
}

impl ReplayCheck {
    /// Compares a replayed tick with the recorded one.
    pub fn add(&mut self, recorded: &TickSeen, replayed: &StageDigests) {
        self.ticks += 1;
        self.requests += u64::from(!recorded.stages.request.is_empty());
        let stage = recorded.stages.first_difference(replayed);
        if let (None, Some(stage)) = (&self.difference, stage) {
            self.difference = Some(Difference::new(recorded.tick, stage));
        }
    }
}

impl Difference {
    fn new(tick: u64, stage: Stage) -> Self {
        Self { tick, stage: stage.to_string() }
    }
}

impl fmt::Display for Difference {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "tick {}: the {} is another", self.tick, self.stage)
    }
}
