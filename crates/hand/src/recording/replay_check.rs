//! What a replay made, held against what was recorded.

use std::fmt;

use serde::Serialize;

use super::stages::{Stage, StageDigests};
use super::tick::TickSeen;

/// How far a replay agrees with its recording.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ReplayCheck {
    /// Ticks that were compared.
    pub ticks: u64,
    /// Ticks with known displacements among them.
    pub requests: u64,
    /// The first difference.
    pub difference: Option<Difference>,
}

/// Where a replay differs first.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Difference {
    /// Tick.
    pub tick: u64,
    /// Stage.
    pub stage: String,
}

impl ReplayCheck {
    /// Compares a tick.
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
