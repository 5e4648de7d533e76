//! Reads from the JSON report of a run in real time the results for its user.

use std::collections::BTreeMap;
use std::path::Path;

use glove_client::run::questions::MODEL_READY;
use serde_json::Value;
use softgrasp_grasp::grasp::{GraspEvent, StateName};

use crate::report_error::ReportError;

/// Results of one run, or of several together; times in ms.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Record {
    pub nodes: usize,
    pub runs: usize,
    pub ticks: u64,
    pub skipped: u64,
    /// Number of ticks that computed for more than 1 ms.
    pub long: u64,
    pub deforming: u64,
    pub answered: u64,
    /// Number of deforming ticks without an answer, by reason.
    pub unanswered: BTreeMap<String, u64>,
    /// Age of the shown answer at the end of each deforming tick that shows one.
    pub ages: Vec<f64>,
    /// Times from the tick in which a grip begins to deform to the one that shows its first answer.
    pub first_answers: Vec<f64>,
    /// Number of grips without a shown answer.
    pub unseen_grips: usize,
    /// Times from the wish to keep a shape, while the object stands still, to its being kept.
    pub keeps: Vec<f64>,
    /// Times from keeping a shape until the server has prepared its model.
    pub ready: Vec<f64>,
    pub round_trips: Vec<f64>,
    pub residual_rel: f64,
    /// Largest error bound, if an answer carried one.
    pub error_bound_rel: Option<f64>,
}

/// Reason of ticks in which a shape is being kept.
const KEEPING: &str = "keeping_shape";

impl Record {
    /// Reads the report of a run.
    ///
    /// # Errors
    /// [`ReportError::Unreadable`] if something is missing.
    pub fn read(path: &Path) -> Result<Self, ReportError> {
        let unreadable = |why: String| ReportError::Unreadable { path: path.to_owned(), why };
        let bytes = std::fs::read(path).map_err(|error| unreadable(error.to_string()))?;
        let json: Value =
            serde_json::from_slice(&bytes).map_err(|error| unreadable(error.to_string()))?;
        Self::of(&json)
            .ok_or_else(|| unreadable("it is no report of a run in real time".to_owned()))
    }

    /// Results in a parsed report; `None` if something is missing.
    pub fn of(json: &Value) -> Option<Self> {
        let summary = &json["summary"];
        let unanswered = summary["unanswered"].as_object()?.iter();
        let mut record = Self {
            nodes: json["object"]["nodes"].as_u64()? as usize,
            runs: 1,
            ticks: json["ticks"].as_u64()?,
            skipped: summary["ticks_skipped"].as_u64()?,
            long: summary["ticks_over_1_ms"].as_u64()?,
            deforming: summary["deforming_ticks"].as_u64()?,
            answered: summary["solves"].as_u64()?,
            unanswered: unanswered
                .map(|(why, n)| Some((why.clone(), n.as_u64()?)))
                .collect::<Option<_>>()?,
            residual_rel: summary["residual_rel_max"].as_f64()?,
            ..Self::default()
        };
        let ticks: Vec<Tick> =
            json["frames"].as_array()?.iter().map(Tick::of).collect::<Option<_>>()?;
        record.add_ages(&ticks);
        record.add_grips(&ticks);
        record.add_keeps(&ticks, &events(json)?);
        for solve in json["frames"].as_array()?.iter().map(|frame| &frame["solve"]) {
            record.round_trips.extend(solve["round_trip_ms"].as_f64());
            let bound = solve["error_bound_rel"].as_f64();
            record.error_bound_rel =
                record.error_bound_rel.into_iter().chain(bound).reduce(f64::max);
        }
        Some(record)
    }

    fn add_ages(&mut self, ticks: &[Tick]) {
        let at = |tick: u64| {
            let place = ticks.binary_search_by_key(&tick, |t| t.tick).ok()?;
            Some(ticks[place].at_ms)
        };
        let shown = ticks.iter().filter(|tick| tick.deforms);
        let ages = shown.filter_map(|t| Some(t.at_ms + t.compute_ms - at(t.shown_tick?)?));
        self.ages.extend(ages);
    }

    fn add_grips(&mut self, ticks: &[Tick]) {
        for grip in ticks.chunk_by(|a, b| a.deforms == b.deforms).filter(|grip| grip[0].deforms) {
            match grip.iter().find(|tick| tick.shown_tick.is_some()) {
                Some(tick) => self.first_answers.push(tick.at_ms + tick.compute_ms - grip[0].at_ms),
                None => self.unseen_grips += 1,
            }
        }
    }

    fn add_keeps(&mut self, ticks: &[Tick], events: &[(f64, String)]) {
        let kept = GraspEvent::ShapeKept.to_string();
        let mut previous = 0.0;
        for (at, _) in events.iter().filter(|(_, what)| *what == kept) {
            let waiting = ticks
                .iter()
                .find(|tick| tick.is_keeping && tick.at_ms >= previous && tick.at_ms <= *at);
            self.keeps.push(waiting.map_or(0.0, |tick| at - tick.at_ms));
            let ready = events.iter().find(|(then, what)| then >= at && what == MODEL_READY);
            self.ready.extend(ready.map(|(then, _)| then - at));
            previous = *at;
        }
    }

    /// Adds the results of another run.
    pub fn append(&mut self, mut other: Self) {
        self.nodes = other.nodes;
        self.runs += other.runs;
        self.ticks += other.ticks;
        self.skipped += other.skipped;
        self.long += other.long;
        self.deforming += other.deforming;
        self.answered += other.answered;
        for (why, count) in other.unanswered {
            *self.unanswered.entry(why).or_default() += count;
        }
        self.unseen_grips += other.unseen_grips;
        self.ages.append(&mut other.ages);
        self.first_answers.append(&mut other.first_answers);
        self.keeps.append(&mut other.keeps);
        self.ready.append(&mut other.ready);
        self.round_trips.append(&mut other.round_trips);
        self.residual_rel = self.residual_rel.max(other.residual_rel);
        let bounds = self.error_bound_rel.into_iter().chain(other.error_bound_rel);
        self.error_bound_rel = bounds.reduce(f64::max);
    }

    /// Whether every deforming tick is answered or has a reason.
    pub fn adds_up(&self) -> bool {
        self.deforming == self.answered + self.unanswered.values().sum::<u64>()
    }
}

/// One tick that was played.
struct Tick {
    tick: u64,
    at_ms: f64,
    compute_ms: f64,
    deforms: bool,
    is_keeping: bool,
    shown_tick: Option<u64>,
}

impl Tick {
    fn of(json: &Value) -> Option<Self> {
        Some(Self {
            tick: json["tick"].as_u64()?,
            at_ms: json["at_ms"].as_f64()?,
            compute_ms: json["compute_ms"].as_f64()?,
            deforms: json["state"].as_str()? == StateName::Deforming.to_string(),
            is_keeping: json["unanswered"] == KEEPING,
            shown_tick: json["shown_tick"].as_u64(),
        })
    }
}

/// Times and words of all events, in order.
fn events(json: &Value) -> Option<Vec<(f64, String)>> {
    let event = |e: &Value| Some((e["at_ms"].as_f64()?, e["what"].as_str()?.to_owned()));
    json["events"].as_array()?.iter().map(event).collect()
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    /// Report of a run with ticks of 10 ms; tick 3 is skipped, the grip of 2 to 6 shows its first answer
    /// in 4.
    fn report() -> Value {
        let tick = |tick: u64, state: &str, shown: Option<u64>, why: Option<&str>| {
            json!({"tick": tick, "at_ms": 10.0 * tick as f64, "state": state, "shown_tick": shown,
                "unanswered": why, "compute_ms": 0.5,
                "solve": shown.map(|_| json!({"round_trip_ms": 2.0, "error_bound_rel": 1e-7}))})
        };
        json!({
            "object": {"nodes": 27}, "ticks": 10,
            "summary": {"ticks_skipped": 1, "ticks_over_1_ms": 0, "deforming_ticks": 5, "solves": 2,
                "residual_rel_max": 1e-12,
                "unanswered": {"new_grip": 1, "tick_skipped": 1, "keeping_shape": 1}},
            "frames": [
                tick(0, "Free", None, None),
                tick(2, "Deforming", None, Some("new_grip")),
                tick(4, "Deforming", Some(2), None),
                tick(5, "Deforming", Some(4), None),
                tick(6, "Deforming", Some(4), Some("keeping_shape")),
                tick(7, "Detached", None, None),
                tick(8, "Deforming", None, Some("new_grip")),
                tick(9, "Detached", None, None),
            ],
            "events": [
                {"at_ms": 1.0, "what": MODEL_READY},
                {"at_ms": 70.0, "what": GraspEvent::ShapeKept.to_string()},
                {"at_ms": 95.0, "what": MODEL_READY},
            ],
        })
    }

    #[test]
    fn ages_grips_and_kept_shapes_are_read_from_ticks_and_events() {
        let record = Record::of(&report()).unwrap();
        assert_eq!(record.ages, [20.5, 10.5, 20.5]);
        assert_eq!((record.first_answers.as_slice(), record.unseen_grips), (&[20.5][..], 1));
        assert_eq!((record.keeps.as_slice(), record.ready.as_slice()), (&[10.0][..], &[25.0][..]));
        assert!(record.adds_up());
        let mut both = record.clone();
        both.append(record.clone());
        assert_eq!((both.runs, both.deforming, both.ages.len()), (2, 10, 6));
        assert_eq!(both.unanswered["new_grip"], 2);
        assert_eq!(both.error_bound_rel, Some(1e-7));
        assert!(both.adds_up());
    }

    #[test]
    fn a_tick_without_answer_and_reason_does_not_add_up_and_other_files_are_refused() {
        let mut json = report();
        json["summary"]["solves"] = 1.into();
        assert!(!Record::of(&json).unwrap().adds_up());
        json["frames"][0]["at_ms"] = Value::Null;
        assert!(Record::of(&json).is_none());
        assert!(Record::of(&Value::Null).is_none());
    }
}
