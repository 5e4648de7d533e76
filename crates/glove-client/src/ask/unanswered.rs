//! Reasons for which a deforming tick has no answer, and how often each occurred.

use std::collections::BTreeMap;
use std::fmt;

/// Why the object could not follow the fingers in a tick in which they deformed it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Unanswered {
    /// The model of this rest shape was still being sent to the server or prepared there.
    ModelNotReady,
    /// The first answer of a new grip, with the columns it needs, was not ready yet.
    NewGrip,
    /// An earlier answer of the same grip was still awaited when a newer request came.
    AnswerLate,
    /// The server was not connected.
    ServerLost,
    /// The server refused the model, or the request.
    Refused,
    /// No equilibrium was found there; the shape stays where it was.
    NoEquilibrium,
    /// The tick was not played, because its time was over.
    TickSkipped,
    /// The shape was being made the new rest shape.
    KeepingShape,
    /// A measurement was not a finite number.
    InputIgnored,
    /// The grasp ended before the request was sent.
    GraspEnded,
    /// The run ended before the answer came.
    RunEnded,
}

impl Unanswered {
    /// Key of the reason in the JSON report.
    pub const fn key(self) -> &'static str {
        match self {
            Self::ModelNotReady => "model_not_ready",
            Self::NewGrip => "new_grip",
            Self::AnswerLate => "answer_late",
            Self::ServerLost => "server_lost",
            Self::Refused => "refused",
            Self::NoEquilibrium => "no_equilibrium",
            Self::TickSkipped => "tick_skipped",
            Self::KeepingShape => "keeping_shape",
            Self::InputIgnored => "input_ignored",
            Self::GraspEnded => "grasp_ended",
            Self::RunEnded => "run_ended",
        }
    }
}

impl fmt::Display for Unanswered {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::ModelNotReady => "the server was still preparing the model",
            Self::NewGrip => "the server was preparing the first answer of a new grip",
            Self::AnswerLate => "the answer before it was late",
            Self::ServerLost => "the server was not there",
            Self::Refused => "the server refused",
            Self::NoEquilibrium => "no equilibrium was found, so the shape stayed",
            Self::TickSkipped => "the tick came too late and was skipped",
            Self::KeepingShape => "the shape was being kept",
            Self::InputIgnored => "a measurement was not a finite number",
            Self::GraspEnded => "the grasp ended first",
            Self::RunEnded => "the run ended first",
        })
    }
}

/// Number of ticks without an answer, by reason.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct UnansweredCounts(BTreeMap<Unanswered, u64>);

impl UnansweredCounts {
    /// Counts ticks without an answer.
    pub fn add(&mut self, reason: Unanswered, ticks: u64) {
        if ticks > 0 {
            *self.0.entry(reason).or_default() += ticks;
        }
    }

    /// Number of all ticks without an answer.
    pub fn total(&self) -> u64 {
        self.0.values().sum()
    }

    /// Reasons and counts, the most frequent first.
    pub fn by_count(&self) -> Vec<(Unanswered, u64)> {
        let mut all: Vec<_> = self.0.iter().map(|(&reason, &count)| (reason, count)).collect();
        all.sort_by_key(|&(_, count)| std::cmp::Reverse(count));
        all
    }
}

impl serde::Serialize for UnansweredCounts {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_map(self.0.iter().map(|(reason, count)| (reason.key(), count)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn counts_are_told_by_reason_and_add_up() {
        let mut counts = UnansweredCounts::default();
        counts.add(Unanswered::NewGrip, 2);
        counts.add(Unanswered::TickSkipped, 5);
        counts.add(Unanswered::NewGrip, 1);
        counts.add(Unanswered::Refused, 0);
        assert_eq!(counts.total(), 8);
        assert_eq!(counts.by_count(), [(Unanswered::TickSkipped, 5), (Unanswered::NewGrip, 3)]);
        let json = serde_json::to_string(&counts).unwrap();
        assert_eq!(json, r#"{"new_grip":3,"tick_skipped":5}"#);
    }
}
