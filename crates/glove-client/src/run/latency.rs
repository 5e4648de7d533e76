//! Times from the first byte of a sample to the display of the displacement that it causes, by stage.

use std::collections::VecDeque;

use serde::Serialize;

use crate::run::answer_tally::Times;

/// Times of a tick that has asked the server.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Asked {
    tick: u64,
    /// Time of the first byte of the older of the two samples that the tick used, s.
    sample_s: f64,
    /// Times at which the tick began and at which it had sent its question, s.
    began_s: f64,
    asked_s: f64,
}

/// Times of all ticks of a run in real time whose answers were taken.
#[derive(Clone, Debug, Default)]
pub struct LatencyLedger {
    asked: VecDeque<Asked>,
    /// Times of each stage, in the order of [`Stage`].
    times: [Times; 5],
}

/// Stages from the sample to the display.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Stage {
    /// From the first byte of the older sample to the tick that uses it.
    SampleToTick,
    /// From the beginning of the tick to the question.
    TickToQuestion,
    /// From the question to the answer, transport included.
    QuestionToAnswer,
    /// From the answer to the end of the tick that shows it.
    AnswerToShown,
    /// From the first byte to the end of the tick that shows what it caused.
    Whole,
}

/// The times of one stage.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct StageLatency {
    /// Median of the times, ms.
    pub p50_ms: f64,
    /// Time that 99 % of the times do not exceed, ms.
    pub p99_ms: f64,
}

/// Quantiles of the times of all stages.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct LatencySummary {
    /// Number of answers that were counted.
    pub answers: usize,
    /// From the first byte of the older sample to the tick that uses it.
    pub sample_to_tick: StageLatency,
    /// From the beginning of the tick to the question.
    pub tick_to_question: StageLatency,
    /// From the question to the answer.
    pub question_to_answer: StageLatency,
    /// From the answer to the end of the tick that shows it.
    pub answer_to_shown: StageLatency,
    /// From the first byte to the end of the tick that shows what it caused.
    pub whole: StageLatency,
}

/// Number of questions that wait for an answer; older ones are given up.
const ASKED_MAX: usize = 1024;

impl LatencyLedger {
    /// Books the question of a tick.
    ///
    /// Units: s on the client's clock.
    pub fn asked(&mut self, tick: u64, sample_s: f64, began_s: f64, asked_s: f64) {
        if self.asked.len() >= ASKED_MAX {
            self.asked.pop_front();
        }
        self.asked.push_back(Asked { tick, sample_s, began_s, asked_s });
    }

    /// Books the answer that a tick shows.
    ///
    /// Units: `round_trip_ms` ms from sending the question to having the answer; `shown_s` s on the
    /// client's clock.
    pub fn shown(&mut self, tick: u64, round_trip_ms: f64, shown_s: f64) {
        let Some(at) = self.asked.iter().position(|asked| asked.tick == tick) else { return };
        let Asked { sample_s, began_s, asked_s, .. } = self.asked[at];
        // Older questions have no answer any more: answers come in the order of their questions.
        self.asked.drain(..=at);
        let ms = |from: f64, to: f64| 1e3 * (to - from);
        let waited = (ms(asked_s, shown_s) - round_trip_ms).max(0.0);
        for (stage, time) in [
            (Stage::SampleToTick, ms(sample_s, began_s)),
            (Stage::TickToQuestion, ms(began_s, asked_s)),
            (Stage::QuestionToAnswer, round_trip_ms),
            (Stage::AnswerToShown, waited),
            (Stage::Whole, ms(sample_s, shown_s)),
        ] {
            self.times[stage as usize].add(time);
        }
    }

    /// Summary of the times; `None` if no answer was counted.
    pub fn summary(&self) -> Option<LatencySummary> {
        let stage = |stage: Stage| {
            let times = &self.times[stage as usize];
            StageLatency {
                p50_ms: times.quantile(0.5).unwrap_or_default(),
                p99_ms: times.quantile(0.99).unwrap_or_default(),
            }
        };
        let answers = self.times[Stage::Whole as usize].count() as usize;
        (answers > 0).then(|| LatencySummary {
            answers,
            sample_to_tick: stage(Stage::SampleToTick),
            tick_to_question: stage(Stage::TickToQuestion),
            question_to_answer: stage(Stage::QuestionToAnswer),
            answer_to_shown: stage(Stage::AnswerToShown),
            whole: stage(Stage::Whole),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stages_add_up_to_the_whole_and_unanswered_questions_are_not_counted() {
        let mut ledger = LatencyLedger::default();
        assert_eq!(ledger.summary(), None);
        // Sample 8 ms before the tick, asked after 1 ms, answered after 4 ms, shown by the tick
        // that ends 20 ms after it began.
        for tick in 0..10u32 {
            let began_s = 0.02 * f64::from(tick);
            ledger.asked(u64::from(tick), began_s - 0.008, began_s, began_s + 0.001);
            if tick % 2 == 1 {
                ledger.shown(u64::from(tick), 4.0, began_s + 0.02);
            }
        }
        ledger.shown(4, 4.0, 1.0);
        let s = ledger.summary().unwrap();
        assert_eq!(s.answers, 5);
        let stages =
            [s.sample_to_tick, s.tick_to_question, s.question_to_answer, s.answer_to_shown];
        for (stage, expected) in stages.iter().zip([8.0, 1.0, 4.0, 15.0]) {
            // Quantiles are good to 0.1 %.
            assert!((stage.p50_ms - expected).abs() < 1e-3 * expected, "{s:?}");
        }
        assert!((s.whole.p99_ms - 28.0).abs() < 0.03, "{s:?}");
    }
}
