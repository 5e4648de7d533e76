//! The report of a run: JSON for programs, and a summary of one screen for people.

use std::time::Duration;

use serde::Serialize;
use softgrasp_core::grasp::{GraspEvent, StateName};

use crate::contact_model::ContactModel;
use crate::hand_reader::DeviceFaults;
use crate::pace::{Due, Pace};
use crate::solve_report::{SCHEMA, SolveSummary};
use crate::tick_budget::TickBudget;
use crate::tick_outcome::{LoopEvent, TickOutcome};
use crate::unanswered::{Unanswered, UnansweredCounts};

/// JSON report of `glove-client run`.
#[derive(Debug, Serialize)]
pub struct RunReport {
    schema: u32,
    command: &'static str,
    /// What was grasped.
    pub object: ObjectSummary,
    /// Which hand.
    pub hand: String,
    /// Where it was solved.
    pub server: String,
    /// `lockstep` or `free`.
    pub pace: &'static str,
    /// What a fingertip holds: `vertex`, `patch` or `mask`.
    pub contact: String,
    /// Ticks of the run, played and skipped.
    pub ticks: u64,
    /// Whether the user ended it.
    pub interrupted: bool,
    /// Grasp states in the order they were first reached.
    pub states_reached: Vec<String>,
    /// Everything that happened.
    pub events: Vec<EventRecord>,
    /// One entry per tick that was played.
    #[serde(rename = "frames")]
    pub played: Vec<TickRecord>,
    /// The run in a few numbers.
    pub summary: RunSummary,
}

/// What was grasped.
#[derive(Clone, Debug, Serialize)]
pub struct ObjectSummary {
    /// Name or file.
    pub name: String,
    /// Nodes.
    pub nodes: usize,
    /// Elements.
    pub tets: usize,
    /// Longest extent, m.
    pub size_m: f64,
    /// What was done to it.
    pub notes: Vec<String>,
}

/// One event.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct EventRecord {
    /// When.
    pub tick: u64,
    /// When, ms since the first tick was due.
    pub at_ms: f64,
    /// `grasp`, `shape` or `server`.
    pub kind: &'static str,
    /// What, in words.
    pub what: String,
}

/// One tick that was played.
#[derive(Clone, Debug, Serialize)]
pub struct TickRecord {
    /// Number, from 0.
    pub tick: u64,
    /// When it began, ms since the first tick was due.
    pub at_ms: f64,
    /// Grasp state after it.
    pub state: String,
    /// Which tips touch: thumb, index, middle, ring, little.
    pub tips: [bool; 5],
    /// Segments shown at their last free pose, by finger.
    pub recalled: [u8; 5],
    /// The answer to what was asked in this tick; null when nothing was asked or no answer came.
    pub solve: Option<SolveSummary>,
    /// Why a deforming tick has no answer; null for all others.
    pub unanswered: Option<&'static str>,
    /// Tick whose answer the object shows after this one; null while it shows none of this grip.
    pub shown_tick: Option<u64>,
    /// Time for which the tick computed, ms.
    pub compute_ms: f64,
}

/// A run in a few numbers.
///
/// Invariant: `deforming_ticks` = `solves` + the sum of `unanswered`.
#[derive(Clone, Debug, Default, Serialize)]
pub struct RunSummary {
    /// Deforming ticks that were answered.
    pub solves: usize,
    /// Ticks in which the fingers deformed the object, skipped ones included.
    pub deforming_ticks: u64,
    /// Deforming ticks without an answer, by reason.
    pub unanswered: UnansweredCounts,
    /// Ticks that were not played because their time was over.
    pub ticks_skipped: u64,
    /// Ticks that computed for longer than a millisecond.
    pub ticks_over_1_ms: u64,
    /// Longest time for which a tick computed, ms.
    pub compute_ms_max: f64,
    /// Largest relative residual.
    pub residual_rel_max: f64,
    /// Median round trip, ms.
    pub round_trip_ms_p50: Option<f64>,
    /// 99 % of the round trips took no longer, ms.
    pub round_trip_ms_p99: Option<f64>,
    /// Longest round trip, ms: the first of a grasp, which computes what the grip needs.
    pub round_trip_ms_max: Option<f64>,
    /// Largest rotation of an element, degrees.
    pub max_rotation_deg: f64,
    /// Largest strain of an element.
    pub max_strain: f64,
    /// Largest resident memory of the server, bytes.
    pub peak_rss_bytes: u64,
    /// Times a shape was kept.
    pub shapes_kept: usize,
    /// Bad records of the glove.
    pub glove_faults: u64,
    /// Bad records of the tracker.
    pub tracker_faults: u64,
}

impl RunReport {
    /// An empty report.
    pub fn new(
        object: ObjectSummary,
        hand: String,
        server: String,
        pace: Pace,
        contact: ContactModel,
    ) -> Self {
        Self {
            schema: SCHEMA,
            command: "run",
            object,
            hand,
            server,
            pace: pace.name(),
            contact: contact.to_string(),
            ticks: 0,
            interrupted: false,
            states_reached: Vec::new(),
            events: Vec::new(),
            played: Vec::new(),
            summary: RunSummary::default(),
        }
    }

    /// Adds a tick, and those that were skipped before it.
    ///
    /// Units: `now_s` s since the first tick was due.
    pub fn add(&mut self, due: Due, now_s: f64, outcome: &TickOutcome) {
        self.add_skipped(due.skipped);
        self.ticks = due.tick + 1;
        let state = outcome.state.map_or("no hand yet".to_owned(), |s| s.to_string());
        if outcome.state.is_some() && !self.states_reached.contains(&state) {
            self.states_reached.push(state.clone());
        }
        let at_ms = 1e3 * now_s;
        self.played.push(TickRecord {
            tick: due.tick,
            at_ms,
            state,
            tips: outcome.tips,
            recalled: outcome.recalled,
            solve: None,
            unanswered: None,
            shown_tick: outcome.shown_tick,
            compute_ms: 0.0,
        });
        self.add_outcome(due.tick, at_ms, outcome);
    }

    /// Adds what came after the last tick.
    pub fn add_last(&mut self, outcome: &TickOutcome) {
        let at_ms = self.played.last().map_or(0.0, |record| record.at_ms);
        self.add_outcome(self.ticks.saturating_sub(1), at_ms, outcome);
    }

    fn add_outcome(&mut self, tick: u64, at_ms: f64, outcome: &TickOutcome) {
        self.add_events(tick, at_ms, &outcome.events);
        for (tick, solve) in &outcome.answers {
            if let Some(record) = self.record(*tick) {
                record.solve = Some(solve.clone());
            }
        }
        for (tick, why) in &outcome.unanswered {
            self.add_unanswered(*tick, *why);
        }
    }

    /// Adds ticks that were not played. They are deforming ticks if the one before them was.
    pub fn add_skipped(&mut self, ticks: u64) {
        self.ticks += ticks;
        self.summary.ticks_skipped += ticks;
        if self.played.last().is_some_and(TickRecord::deforms) {
            self.summary.deforming_ticks += ticks;
            self.summary.unanswered.add(Unanswered::TickSkipped, ticks);
        }
    }

    /// Adds how long the last tick computed.
    pub fn add_computed(&mut self, computed: Duration) {
        if let Some(record) = self.played.last_mut() {
            record.compute_ms = computed.as_secs_f64() * 1e3;
        }
    }

    fn add_unanswered(&mut self, tick: u64, why: Unanswered) {
        if let Some(record) = self.record(tick)
            && record.unanswered.is_none()
        {
            record.unanswered = Some(why.key());
            self.summary.unanswered.add(why, 1);
        }
    }

    /// The record of a tick that was played.
    fn record(&mut self, tick: u64) -> Option<&mut TickRecord> {
        let at = self.played.binary_search_by_key(&tick, |record| record.tick).ok()?;
        self.played.get_mut(at)
    }

    fn add_events(&mut self, tick: u64, at_ms: f64, events: &[LoopEvent]) {
        self.events.extend(events.iter().map(|event| {
            let (kind, what) = match event {
                LoopEvent::Grasp(GraspEvent::TipTouched(finger, node)) => {
                    ("grasp", format!("{finger} touched node {node}"))
                }
                LoopEvent::Grasp(event) => ("grasp", event.to_string()),
                LoopEvent::KeepRefused(text) => ("shape", format!("keep shape refused: {text}")),
                LoopEvent::Shape(text) => ("shape", text.clone()),
                LoopEvent::Server(text) => ("server", text.clone()),
            };
            EventRecord { tick, at_ms, kind, what }
        }));
    }

    /// Fills the summary. What is not answered by now never is.
    pub fn finish(&mut self, faults: DeviceFaults, budget: &TickBudget) {
        let open = |record: &&TickRecord| {
            record.deforms() && record.solve.is_none() && record.unanswered.is_none()
        };
        let open: Vec<u64> = self.played.iter().filter(open).map(|record| record.tick).collect();
        open.into_iter().for_each(|tick| self.add_unanswered(tick, Unanswered::RunEnded));
        let solves: Vec<&SolveSummary> =
            self.played.iter().filter_map(|record| record.solve.as_ref()).collect();
        let mut round_trips: Vec<f64> = solves.iter().map(|s| s.round_trip_ms).collect();
        round_trips.sort_by(f64::total_cmp);
        let quantile = |q: f64| {
            let last = round_trips.len().checked_sub(1)?;
            round_trips.get((q * last as f64).round() as usize).copied()
        };
        let most = |of: fn(&SolveSummary) -> f64| solves.iter().map(|s| of(s)).fold(0.0, f64::max);
        let deforming = self.played.iter().filter(|record| record.deforms()).count() as u64;
        let kept = GraspEvent::ShapeKept.to_string();
        let counted = &self.summary;
        self.summary = RunSummary {
            solves: solves.len(),
            // Those that were skipped are there already.
            deforming_ticks: counted.deforming_ticks + deforming,
            unanswered: counted.unanswered.clone(),
            ticks_skipped: counted.ticks_skipped,
            ticks_over_1_ms: budget.over(),
            compute_ms_max: budget.longest().as_secs_f64() * 1e3,
            residual_rel_max: most(|s| s.residual_rel),
            round_trip_ms_p50: quantile(0.5),
            round_trip_ms_p99: quantile(0.99),
            round_trip_ms_max: quantile(1.0),
            max_rotation_deg: most(|s| s.max_rotation_deg),
            max_strain: most(|s| s.max_strain),
            peak_rss_bytes: solves.iter().map(|s| s.peak_rss_bytes).max().unwrap_or(0),
            shapes_kept: self.events.iter().filter(|e| e.what == kept).count(),
            glove_faults: faults.glove,
            tracker_faults: faults.tracker,
        };
    }

    /// Why the run is a failure: answers were asked for and none came. `None` if it is none.
    pub fn failure(&self) -> Option<String> {
        let s = &self.summary;
        if s.solves > 0 || s.deforming_ticks == 0 || self.interrupted {
            return None;
        }
        let said = |event: &&EventRecord| {
            event.kind == "server"
                && ["refused ", "lost: "].iter().any(|w| event.what.starts_with(w))
        };
        let why = match self.events.iter().rfind(said) {
            Some(event) => format!("the server {}", event.what.replacen("lost", "was lost", 1)),
            None => {
                s.unanswered.by_count().first().map_or_else(String::new, |(why, _)| why.to_string())
            }
        };
        Some(format!("none of {} deforming ticks was answered: {why}", s.deforming_ticks))
    }

    /// One screen for a person who has never seen the program.
    pub fn describe(&self) -> String {
        let s = &self.summary;
        let ms = |value: Option<f64>| value.map_or("-".to_owned(), |v| format!("{v:.2} ms"));
        let solve = self.played.iter().rev().find_map(|record| record.solve.as_ref());
        let mut text = format!(
            "\n{} ({} nodes, {} tetrahedra, {:.0} mm) in the {} hand, held by {}, solved by {}\n",
            self.object.name,
            self.object.nodes,
            self.object.tets,
            1e3 * self.object.size_m,
            self.hand,
            self.contact,
            self.server
        );
        for note in &self.object.notes {
            text.push_str(&format!("  {note}\n"));
        }
        text.push_str("\nWhat happened:\n");
        for event in &self.events {
            text.push_str(&format!("  tick {:>5}  {}\n", event.tick, event.what));
        }
        text.push_str(&format!("\n  ticks               {}", self.ticks));
        if s.ticks_skipped > 0 {
            text.push_str(&format!(
                ", of which {} came too late and were skipped",
                s.ticks_skipped
            ));
        }
        text.push_str(&format!("\n  grasp states        {}\n", self.states_reached.join(", ")));
        text.push_str(&format!(
            "  deforming ticks     {} of {} answered\n",
            s.solves, s.deforming_ticks
        ));
        for (why, count) in s.unanswered.by_count() {
            text.push_str(&format!("    not answered      {count}: {why}\n"));
        }
        // A tick that waits for plans and kept shapes may compute for as long as they take.
        if s.ticks_over_1_ms > 0 && self.pace == Pace::Free.name() {
            text.push_str(&format!(
                "  long ticks          {} computed for more than 1 ms ({:.1} ms at most)\n",
                s.ticks_over_1_ms, s.compute_ms_max
            ));
        }
        if let Some(solve) = solve {
            text.push_str(&format!(
                "  equations           {} unknown, {} prescribed, by {}\n  \
                 answer came after   {} (median), {} (99 %), {} (slowest: a new grip)\n  \
                 residual            {:.1e} at most\n  \
                 shape               turned by {:.1} degrees, strained by {:.0} % at most\n",
                solve.unknown_dofs,
                solve.known_dofs,
                solve.method,
                ms(s.round_trip_ms_p50),
                ms(s.round_trip_ms_p99),
                ms(s.round_trip_ms_max),
                s.residual_rel_max,
                s.max_rotation_deg,
                100.0 * s.max_strain,
            ));
        }
        if self.interrupted {
            text.push_str("  ended by the user\n");
        }
        text
    }
}

impl TickRecord {
    /// Whether the fingers deformed the object.
    fn deforms(&self) -> bool {
        self.state == StateName::Deforming.to_string()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tick_budget::Priority;

    fn report() -> RunReport {
        let object = ObjectSummary {
            name: "cube".to_owned(),
            nodes: 8,
            tets: 6,
            size_m: 0.1,
            notes: vec![],
        };
        let contact = ContactModel::default();
        RunReport::new(object, "none".to_owned(), "none".to_owned(), Pace::Free, contact)
    }

    fn tick(report: &mut RunReport, tick: u64, skipped: u64, outcome: TickOutcome) {
        report.add(Due { tick, skipped }, 0.01 * tick as f64, &outcome);
    }

    fn deforming() -> TickOutcome {
        TickOutcome { state: Some(StateName::Deforming), ..TickOutcome::default() }
    }

    #[test]
    fn every_deforming_tick_is_answered_or_has_one_reason() {
        let mut report = report();
        let free = TickOutcome { state: Some(StateName::Free), ..TickOutcome::default() };
        tick(&mut report, 0, 0, free.clone());
        // Missed while nothing is deformed: no answer is missing.
        tick(&mut report, 4, 3, deforming());
        // Missed while something is.
        let solve = SolveSummary::new(&softgrasp_protocol::SolveReport::default(), 0.5);
        let answered = TickOutcome { answers: vec![(4, solve)], ..deforming() };
        tick(&mut report, 7, 2, answered);
        let late = (7, Unanswered::AnswerLate);
        tick(&mut report, 8, 0, TickOutcome { unanswered: vec![late, late], ..deforming() });
        tick(&mut report, 9, 0, free);
        report.add_skipped(2);
        report.finish(DeviceFaults::default(), &TickBudget::new(Priority::Ordinary));
        let s = &report.summary;
        assert_eq!((report.ticks, s.ticks_skipped), (12, 7));
        let mut counts = UnansweredCounts::default();
        counts.add(Unanswered::TickSkipped, 2);
        counts.add(Unanswered::AnswerLate, 1);
        counts.add(Unanswered::RunEnded, 1);
        assert_eq!(s.unanswered, counts);
        assert_eq!(s.deforming_ticks, s.solves as u64 + s.unanswered.total());
        assert_eq!(report.failure(), None);
    }

    #[test]
    fn run_without_any_answer_says_what_the_server_refused() {
        let mut report = report();
        let refused = LoopEvent::Server("refused the model (BadRequest): too soft".to_owned());
        let unanswered = vec![(0, Unanswered::Refused)];
        tick(&mut report, 0, 0, TickOutcome { events: vec![refused], unanswered, ..deforming() });
        report.finish(DeviceFaults::default(), &TickBudget::new(Priority::Ordinary));
        let why = report.failure().unwrap();
        assert_eq!(
            why,
            "none of 1 deforming ticks was answered: the server refused the model (BadRequest): \
             too soft"
        );
    }
}
