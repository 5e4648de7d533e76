//! Records of the further objects of a run, for its report.

use serde::Serialize;
use softgrasp_grasp::grasp::StateName;
use softgrasp_hand::loaded_object::ObjectSummary;

use crate::ask::unanswered::{Unanswered, UnansweredCounts};
use crate::run::answer_tally::AnswerTally;
use crate::run::contact_ledger::ContactTotals;
use crate::run::played_ticks::{FurtherRecord, PlayedTicks};
use crate::run::tick_outcome::TickOutcome;

/// A further object of a run, and its answers in a few numbers.
///
/// Invariant: at the end of the run `deforming_ticks` = `solves` + the sum of `unanswered`.
#[derive(Clone, Debug, Serialize)]
pub struct FurtherReport {
    /// Number of the object, from 2.
    pub number: usize,
    /// The object itself.
    pub object: ObjectSummary,
    /// Place of its origin when the run began, m, in the world frame.
    pub home_m: [f64; 3],
    /// Place of its origin at the end of the run.
    pub at_m: [f64; 3],
    /// Number of ticks in which a hand touched it and that were answered.
    pub solves: usize,
    /// Number of ticks in which a hand touched it, skipped ones included.
    pub deforming_ticks: u64,
    /// Number of such ticks without an answer, by reason.
    pub unanswered: UnansweredCounts,
    /// Median round trip of its answers, ms.
    pub round_trip_ms_p50: Option<f64>,
    /// Longest round trip, ms.
    pub round_trip_ms_max: Option<f64>,
    /// Median age of its shape in the ticks in which a hand touched it, ms.
    pub shown_age_ms_p50: Option<f64>,
    /// Age of its oldest shape, ms.
    pub shown_age_ms_max: Option<f64>,
    /// How well its steps met the law of contact; null without a step.
    pub contact: Option<ContactTotals>,
    #[serde(skip)]
    answers: AnswerTally,
}

impl FurtherReport {
    /// Report of an object that lies at its home before the first tick.
    ///
    /// Units: m. Frame: world.
    pub fn new(number: usize, object: ObjectSummary, home_m: [f64; 3]) -> Self {
        Self {
            number,
            object,
            home_m,
            at_m: home_m,
            solves: 0,
            deforming_ticks: 0,
            unanswered: UnansweredCounts::default(),
            round_trip_ms_p50: None,
            round_trip_ms_max: None,
            shown_age_ms_p50: None,
            shown_age_ms_max: None,
            contact: None,
            answers: AnswerTally::default(),
        }
    }

    /// Record of a tick; its answer may come later.
    pub(crate) fn record(
        &mut self,
        part: &TickOutcome,
        at_ms: f64,
        played: &PlayedTicks,
    ) -> FurtherRecord {
        if part.state == Some(StateName::Deforming) {
            self.deforming_ticks += 1;
            let asked_ms = part.shown_tick.and_then(|asked| played.get(asked)).map(|at| at.at_ms);
            if let Some(asked_ms) = asked_ms {
                self.answers.ages.add(at_ms - asked_ms);
            }
        }
        FurtherRecord {
            object: self.number,
            state: part.state.map_or("no hand yet".to_owned(), |state| state.to_string()),
            tips: part.tips,
            contact: None,
            unanswered: None,
            shown_tick: part.shown_tick,
        }
    }

    /// Adds ticks that were not played after this one.
    pub(crate) fn add_skipped(&mut self, last: &FurtherRecord, ticks: u64) {
        if last.deforms() {
            self.deforming_ticks += ticks;
            self.unanswered.add(Unanswered::TickSkipped, ticks);
        }
    }

    /// Ends a record that leaves memory: its answer is not awaited any more.
    pub(crate) fn forget(&mut self, older: &FurtherRecord) {
        if older.is_open() {
            self.unanswered.add(Unanswered::AnswerLate, 1);
        }
    }

    /// Adds answers, and ticks that have none, to the records that asked.
    pub(crate) fn add(&mut self, part: &TickOutcome, played: &mut PlayedTicks) {
        let place = self.number.saturating_sub(2);
        for step in &part.steps {
            self.contact.get_or_insert_default().add(step);
            let record = played.get_mut(step.tick).and_then(|tick| tick.further.get_mut(place));
            let Some(record) = record else { continue };
            record.contact = Some(*step);
            if record.deforms() {
                let answer = part.answers.iter().find(|(tick, _)| *tick == step.tick);
                if let Some((_, solve)) = answer {
                    self.answers.add(solve);
                }
            }
        }
        for (tick, why) in &part.unanswered {
            let record = played.get_mut(*tick).and_then(|tick| tick.further.get_mut(place));
            if let Some(record) = record.filter(|record| record.is_open()) {
                record.unanswered = Some(why.key());
                self.unanswered.add(*why, 1);
            }
        }
    }

    /// Fills the numbers at the end of a run. A request without an answer by now stays without one.
    pub(crate) fn finish(&mut self, played: &mut PlayedTicks) {
        let place = self.number.saturating_sub(2);
        for record in played.iter_mut().filter_map(|tick| tick.further.get_mut(place)) {
            if record.is_open() {
                record.unanswered = Some(Unanswered::RunEnded.key());
                self.unanswered.add(Unanswered::RunEnded, 1);
            }
        }
        self.solves = self.answers.solves;
        let (trips, ages) = (&self.answers.round_trips, &self.answers.ages);
        (self.round_trip_ms_p50, self.round_trip_ms_max) =
            (trips.quantile(0.5), trips.quantile(1.0));
        (self.shown_age_ms_p50, self.shown_age_ms_max) = (ages.quantile(0.5), ages.quantile(1.0));
    }

    /// The object and its numbers as text for the summary.
    pub fn words(&self) -> String {
        let ObjectSummary { name, nodes, .. } = &self.object;
        let moved = self.at_m.iter().zip(&self.home_m).map(|(now, home)| (now - home).powi(2));
        let mut text = format!(
            "\nObject {}, {name} ({nodes} nodes), lies {:.0} mm from where it lay:\n  \
             deforming ticks     {} of {} answered\n",
            self.number,
            1e3 * moved.sum::<f64>().sqrt(),
            self.solves,
            self.deforming_ticks,
        );
        for (why, count) in self.unanswered.by_count() {
            text.push_str(&format!("    not answered      {count}: {why}\n"));
        }
        text + &self.contact.as_ref().map_or(String::new(), ContactTotals::words)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::run::contact_ledger::StepRecord;
    use crate::run::played_ticks::TickRecord;
    use softgrasp_protocol::SolveReport;
    use softgrasp_protocol::solve_report::SolveSummary;

    #[test]
    fn every_tick_in_which_a_further_object_is_touched_is_answered_or_has_a_reason() {
        let summary = ObjectSummary {
            name: "sphere".to_owned(),
            nodes: 9,
            tets: 12,
            size_m: 0.05,
            notes: Vec::new(),
        };
        let mut report = FurtherReport::new(2, summary, [0.1, 0.0, 0.0]);
        let mut played = PlayedTicks::default();
        let touched = TickOutcome { state: Some(StateName::Deforming), ..TickOutcome::default() };
        for tick in 0..4 {
            let record = report.record(&touched, 10.0 * tick as f64, &played);
            let (at_ms, further) = (10.0 * tick as f64, vec![record]);
            played.push(TickRecord { tick, at_ms, further, ..TickRecord::default() });
        }
        let step = StepRecord { tick: 0, table_force_n: 0.5, ..StepRecord::default() };
        let answer = SolveSummary::new(SolveReport::default(), None, 3.0);
        let part = TickOutcome { steps: vec![step], answers: vec![(0, answer)], ..touched.clone() };
        report.add(&part, &mut played);
        let late = (1, Unanswered::AnswerLate);
        report.add(&TickOutcome { unanswered: vec![late, late], ..touched }, &mut played);
        let last = played.last().map(|tick| tick.further[0].clone()).unwrap();
        report.add_skipped(&last, 2);
        report.finish(&mut played);
        let without = report.unanswered.total();
        assert_eq!((report.deforming_ticks, report.solves, without), (6, 1, 5));
        assert_eq!(played.get(0).unwrap().further[0].contact.unwrap().table_force_n, 0.5);
        assert_eq!(played.get(3).unwrap().further[0].unanswered, Some(Unanswered::RunEnded.key()));
        assert!(report.words().contains("Object 2, sphere"), "{}", report.words());
    }
}
