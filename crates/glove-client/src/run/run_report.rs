//! The report of a run: JSON for programs, and a summary of one screen for people.

use std::time::Duration;

use serde::Serialize;
use softgrasp_force::ForceReport;
use softgrasp_grasp::grasp::{GraspEvent, StateName};
use softgrasp_grasp::object::ContactModel;
use softgrasp_hand::hand_reader::DeviceFaults;
use softgrasp_hand::joints_reader::FitErrors;
use softgrasp_hand::loaded_object::ObjectSummary;
use softgrasp_hand::recording::{Difference, ReplayCheck, ReplayHand};
use softgrasp_protocol::solve_report::{SCHEMA, SolveSummary};

use crate::ask::unanswered::{Unanswered, UnansweredCounts};
use crate::pace::tick_budget::TickBudget;
use crate::pace::{Due, Pace};
use crate::run::answer_tally::AnswerTally;
use crate::run::contact_ledger::ContactTotals;
use crate::run::further_report::FurtherReport;
use crate::run::latency::LatencySummary;
use crate::run::played_ticks::{PlayedTicks, TickRecord};
use crate::run::tick_outcome::{LoopEvent, TickOutcome};

/// JSON report of `glove-client run`.
#[derive(Debug, Serialize)]
pub struct RunReport {
    schema: u32,
    command: &'static str,
    /// Object that was grasped.
    pub object: ObjectSummary,
    /// Kind of hand.
    pub hand: String,
    /// Server that solved: its address, or `embedded`.
    pub server: String,
    /// How ticks and server kept step: `lockstep` or `free`.
    pub pace: &'static str,
    /// What a fingertip held: `vertex`, `patch` or `mask`.
    pub contact: String,
    /// Number of ticks of the run, played and skipped.
    pub ticks: u64,
    /// Whether the user ended the run.
    pub interrupted: bool,
    /// States of the grasp, in the order in which they were first reached.
    pub states_reached: Vec<String>,
    /// The further objects of the run, in their order; absent in a run of one.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub further_objects: Vec<FurtherReport>,
    /// Events of the run, in their order.
    pub events: Vec<EventRecord>,
    /// Number of events beyond the first 10 000, which are not listed.
    pub events_left_out: u64,
    /// Record of each tick that was played.
    #[serde(rename = "frames")]
    pub played: PlayedTicks,
    /// Reason why records of older ticks are missing; null if none is.
    pub frames_missing: Option<String>,
    /// The run in a few numbers.
    pub summary: RunSummary,
    /// Forces that a device has rendered; null without one.
    pub force: Option<ForceReport>,
    /// Comparison of a replay with its recording; null for other hands.
    pub replay: Option<ReplaySummary>,
    /// Reason why the recording of this run is incomplete; null if it is complete, or if there is none.
    pub recording_failed: Option<String>,
    /// Faults of devices from which no pose of a hand ever came; null if one came.
    pub no_hand: Option<Vec<String>>,
    /// Totals of the answers.
    #[serde(skip)]
    answers: AnswerTally,
    /// Text of the server's last refusal, or reason of its loss.
    #[serde(skip)]
    pub(crate) last_failure: Option<String>,
}

/// Largest number of events that are listed; a device with a loose contact could cause any number.
const EVENTS_MAX: usize = 10_000;

/// Comparison of a replay with its recording.
#[derive(Clone, Debug, Serialize)]
pub struct ReplaySummary {
    /// Number of ticks that were compared.
    pub ticks: u64,
    /// Number of ticks that could be read in the recording.
    pub recorded: u64,
    /// Number of compared ticks with known displacements.
    pub requests: u64,
    /// Tick and stage of the first difference; null if there is none.
    pub difference: Option<Difference>,
    /// Reason why the recording is cut off; null for a complete one.
    pub cut: Option<String>,
}

impl ReplaySummary {
    /// Comparison that a replayed hand has made.
    pub fn of(hand: &ReplayHand) -> Self {
        let ReplayCheck { ticks, requests, difference } = hand.check.clone();
        let recording = hand.recording();
        let recorded = recording.ticks.len() as u64;
        Self { ticks, recorded, requests, difference, cut: recording.cut.clone() }
    }

    /// Reason why the replay does not confirm its recording; `None` if it does.
    pub fn failed(&self, interrupted: bool) -> Option<String> {
        let Self { ticks, recorded, difference, cut, .. } = self;
        match (difference, cut) {
            (Some(difference), _) => {
                Some(format!("the replay differs from its recording in {difference}"))
            }
            (None, _) if interrupted || ticks < recorded => Some(format!(
                "the replay was ended before the recording was over: {ticks} of {recorded} ticks \
                 were compared"
            )),
            (None, Some(why)) => Some(format!(
                "the recording is not whole: only its first {ticks} ticks could be compared: {why}"
            )),
            (None, None) if *ticks == 0 => {
                Some("the recording has no ticks: nothing was compared".to_owned())
            }
            (None, None) => None,
        }
    }
}

/// One event of a run.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct EventRecord {
    /// Tick of the event.
    pub tick: u64,
    /// Time of the event, ms since the first tick was due.
    pub at_ms: f64,
    /// Kind of the event: `grasp`, `shape` or `server`.
    pub kind: &'static str,
    /// What happened, in words.
    pub what: String,
}

/// A run in a few numbers.
///
/// Invariant: `deforming_ticks` = `solves` + the sum of `unanswered`.
#[derive(Clone, Debug, Default, Serialize)]
pub struct RunSummary {
    /// Number of deforming ticks that were answered.
    pub solves: usize,
    /// Number of ticks in which the fingers deformed the object, skipped ones included.
    pub deforming_ticks: u64,
    /// Number of deforming ticks without an answer, by reason.
    pub unanswered: UnansweredCounts,
    /// Number of ticks that were not played because their time was over.
    pub ticks_skipped: u64,
    /// Number of ticks that computed for longer than a millisecond.
    pub ticks_over_1_ms: u64,
    /// Longest computing time of a tick, ms.
    pub compute_ms_max: f64,
    /// Times from the first byte of a sample to the display of the displacement that it causes, by stage;
    /// null for a run whose ticks wait for their answers, or without deformation.
    pub latency: Option<LatencySummary>,
    /// Largest relative residual of an answer.
    pub residual_rel_max: f64,
    /// Median round trip, ms.
    pub round_trip_ms_p50: Option<f64>,
    /// Time that 99 % of the round trips did not exceed, ms.
    pub round_trip_ms_p99: Option<f64>,
    /// Longest round trip, ms: that of the first question of a grasp, which computes the columns of the
    /// grip.
    pub round_trip_ms_max: Option<f64>,
    /// Median age of the shape that a deforming tick showed, ms: the time since the tick that had asked
    /// for it; null if none was shown.
    pub shown_age_ms_p50: Option<f64>,
    /// Age that 99 % of the shapes did not exceed, ms.
    pub shown_age_ms_p99: Option<f64>,
    /// Age of the oldest shape, ms.
    pub shown_age_ms_max: Option<f64>,
    /// Sum of the lengths of all answered requests on the wire, bytes.
    pub bytes_sent: u64,
    /// Sum of the lengths of their answers on the wire, bytes.
    pub bytes_received: u64,
    /// Largest rotation of an element, degrees, of the answers that tell it; null where none does.
    pub max_rotation_deg: Option<f64>,
    /// Largest strain of an element, of the same answers.
    pub max_strain: Option<f64>,
    /// Number of answers by the equations of large deformation; the others were linear.
    pub large_solves: usize,
    /// Largest estimated error of an answer, relative to its largest displacement; null if none was
    /// estimated.
    pub error_estimate_rel_max: Option<f64>,
    /// Smallest ratio of an element's volume to that at rest; null without large deformation.
    pub min_jacobian: Option<f64>,
    /// How well the steps of a grasp by friction met the law of contact; null for the thesis's rules.
    pub contact: Option<ContactTotals>,
    /// Number of equilibria that jumped to another shape.
    pub jumps: usize,
    /// Largest resident memory of the server, bytes.
    pub peak_rss_bytes: u64,
    /// Number of shapes that were kept.
    pub shapes_kept: usize,
    /// Number of ticks in which a device was silent and the hand kept its pose.
    pub ticks_held: u64,
    /// Number of jumps of the tracker to the opposite side of its field.
    pub hemisphere_flips: u64,
    /// Number of bad lines of joints, and of lines that no hand fits.
    pub joint_faults: u64,
    /// Distances of the fitted hand from the joints that were sent; null if none were sent.
    pub joint_fit: Option<FitErrors>,
    /// Number of pieces of device bytes that were dropped because no tick took them in time.
    pub pieces_dropped: u64,
    /// Number of readings of the glove that no hand can cause and that were ignored.
    pub glove_jumps: u64,
    /// Number of poses of the tracker that no hand can cause and that were ignored.
    pub tracker_jumps: u64,
    /// Number of bad records of the glove.
    pub glove_faults: u64,
    /// Number of bad records of the tracker.
    pub tracker_faults: u64,
}

impl RunReport {
    /// Report of a run without a tick.
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
            further_objects: Vec::new(),
            events: Vec::new(),
            events_left_out: 0,
            played: PlayedTicks::default(),
            frames_missing: None,
            summary: RunSummary::default(),
            force: None,
            replay: None,
            recording_failed: None,
            no_hand: None,
            answers: AnswerTally::default(),
            last_failure: None,
        }
    }

    /// The last answer of the run.
    pub(crate) fn last_answer(&self) -> Option<&SolveSummary> {
        self.answers.last.as_ref()
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
        let parts = self.further_objects.iter_mut().zip(&outcome.further);
        let further =
            parts.map(|(object, part)| object.record(part, at_ms, &self.played)).collect();
        let older = self.played.push(TickRecord {
            tick: due.tick,
            at_ms,
            state,
            tips: outcome.tips,
            recalled: outcome.recalled,
            solve: None,
            contact: None,
            unanswered: None,
            shown_tick: outcome.shown_tick,
            compute_ms: 0.0,
            further,
        });
        // Its answer is not awaited any more.
        if let Some(older) = older {
            if older.is_open() {
                self.summary.unanswered.add(Unanswered::AnswerLate, 1);
            }
            let objects = self.further_objects.iter_mut().zip(&older.further);
            objects.for_each(|(object, record)| object.forget(record));
        }
        if outcome.state == Some(StateName::Deforming) {
            self.summary.deforming_ticks += 1;
            let asked = outcome.shown_tick.and_then(|asked| self.played.get(asked));
            if let Some(asked_ms) = asked.map(|record| record.at_ms) {
                self.answers.ages.add(at_ms - asked_ms);
            }
        }
        self.summary.ticks_held += u64::from(!outcome.silent.is_empty());
        self.add_outcome(due.tick, at_ms, outcome);
    }

    /// Adds the news that came after the last tick.
    pub fn add_last(&mut self, outcome: &TickOutcome) {
        let at_ms = self.played.last().map_or(0.0, |record| record.at_ms);
        self.add_outcome(self.ticks.saturating_sub(1), at_ms, outcome);
    }

    fn add_outcome(&mut self, tick: u64, at_ms: f64, outcome: &TickOutcome) {
        self.add_events(tick, at_ms, &outcome.events);
        for (tick, solve) in &outcome.answers {
            // Steps of an object that no finger touches are not counted.
            if let Some(record) = self.played.get_mut(*tick).filter(|record| record.deforms()) {
                record.solve = Some(solve.clone());
                self.answers.add(solve);
            }
        }
        for step in &outcome.steps {
            self.summary.contact.get_or_insert_default().add(step);
            if let Some(record) = self.played.get_mut(step.tick) {
                record.contact = Some(*step);
            }
        }
        for (tick, why) in &outcome.unanswered {
            self.add_unanswered(*tick, *why);
        }
        for (object, part) in self.further_objects.iter_mut().zip(&outcome.further) {
            object.add(part, &mut self.played);
        }
    }

    /// Adds ticks that were not played; they are deforming ticks if the one before them was.
    pub fn add_skipped(&mut self, ticks: u64) {
        self.ticks += ticks;
        self.summary.ticks_skipped += ticks;
        if self.played.last().is_some_and(TickRecord::deforms) {
            self.summary.deforming_ticks += ticks;
            self.summary.unanswered.add(Unanswered::TickSkipped, ticks);
        }
        let last = self.played.last().map_or(&[][..], |last| last.further.as_slice());
        let objects = self.further_objects.iter_mut().zip(last);
        objects.for_each(|(object, last)| object.add_skipped(last, ticks));
    }

    /// Adds the computing time of the last tick.
    pub fn add_computed(&mut self, computed: Duration) {
        if let Some(record) = self.played.last_mut() {
            record.compute_ms = computed.as_secs_f64() * 1e3;
        }
    }

    fn add_unanswered(&mut self, tick: u64, why: Unanswered) {
        if let Some(record) = self.played.get_mut(tick)
            && record.deforms()
            && record.unanswered.is_none()
        {
            record.unanswered = Some(why.key());
            self.summary.unanswered.add(why, 1);
        }
    }

    fn add_events(&mut self, tick: u64, at_ms: f64, events: &[LoopEvent]) {
        for event in events {
            let (kind, what) = event.kind_and_words();
            self.summary.shapes_kept += usize::from(what == GraspEvent::ShapeKept.to_string());
            if kind == "server" && ["refused ", "lost: "].iter().any(|word| what.starts_with(word))
            {
                self.last_failure = Some(what.clone());
            }
            match self.events.len() < EVENTS_MAX {
                true => self.events.push(EventRecord { tick, at_ms, kind, what }),
                false => self.events_left_out += 1,
            }
        }
    }

    /// Deforming ticks without answer or reason, each with the reason that it ends with. A tick before an
    /// answered one did not wait for the end of the run: its answer was lost with the server, or a newer
    /// request replaced it.
    fn open_ticks(&self) -> Vec<(u64, Unanswered)> {
        let answered = self.played.iter().filter(|record| record.solve.is_some());
        let last_answered = answered.map(|record| record.tick).max();
        let lost =
            self.events.iter().filter(|e| e.kind == "server" && e.what.starts_with("lost: "));
        let last_lost = lost.map(|event| event.tick).max();
        let why = |tick: u64| match (last_answered > Some(tick), last_lost >= Some(tick)) {
            (false, _) => Unanswered::RunEnded,
            (true, true) => Unanswered::ServerLost,
            (true, false) => Unanswered::AnswerLate,
        };
        let open = self.played.iter().filter(|record| record.is_open());
        open.map(|record| (record.tick, why(record.tick))).collect()
    }

    /// Fills the summary. A request without an answer by now stays without one.
    pub fn finish(&mut self, faults: DeviceFaults, budget: &TickBudget) {
        for (tick, why) in self.open_ticks() {
            self.add_unanswered(tick, why);
        }
        for object in &mut self.further_objects {
            object.finish(&mut self.played);
        }
        self.frames_missing = self.played.why_missing().map(str::to_owned);
        let (counted, answers) = (&self.summary, &self.answers);
        self.summary = RunSummary {
            solves: answers.solves,
            deforming_ticks: counted.deforming_ticks,
            unanswered: counted.unanswered.clone(),
            ticks_skipped: counted.ticks_skipped,
            ticks_over_1_ms: budget.over(),
            compute_ms_max: budget.longest().as_secs_f64() * 1e3,
            // Booked by whoever plays the ticks.
            latency: None,
            joint_fit: None,
            pieces_dropped: 0,
            residual_rel_max: answers.residual_rel_max,
            round_trip_ms_p50: answers.round_trips.quantile(0.5),
            round_trip_ms_p99: answers.round_trips.quantile(0.99),
            round_trip_ms_max: answers.round_trips.quantile(1.0),
            shown_age_ms_p50: answers.ages.quantile(0.5),
            shown_age_ms_p99: answers.ages.quantile(0.99),
            shown_age_ms_max: answers.ages.quantile(1.0),
            bytes_sent: answers.bytes_sent,
            bytes_received: answers.bytes_received,
            max_rotation_deg: answers.max_rotation_deg,
            max_strain: answers.max_strain,
            large_solves: answers.large_solves,
            error_estimate_rel_max: answers.error_estimate_rel_max,
            min_jacobian: answers.min_jacobian,
            contact: counted.contact.clone(),
            jumps: answers.jumps,
            peak_rss_bytes: answers.peak_rss_bytes,
            shapes_kept: counted.shapes_kept,
            ticks_held: counted.ticks_held,
            hemisphere_flips: faults.hemisphere_flips,
            joint_faults: faults.joints,
            glove_jumps: faults.glove_jumps,
            tracker_jumps: faults.tracker_jumps,
            glove_faults: faults.glove,
            tracker_faults: faults.tracker,
        };
    }
}

#[cfg(test)]
mod tests;
