//! What a run tells afterwards: the JSON report and the summary a newcomer understands.

use serde::Serialize;
use softgrasp_core::grasp::{GraspEvent, StateName};

use crate::contact_model::ContactModel;
use crate::grasp_loop::{LoopEvent, TickOutcome};
use crate::hand_reader::DeviceFaults;
use crate::solve_report::{SCHEMA, SolveSummary};

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
    /// Ticks played.
    pub ticks: u64,
    /// Whether the user ended it.
    pub interrupted: bool,
    /// Grasp states in the order they were first reached.
    pub states_reached: Vec<String>,
    /// Everything that happened.
    pub events: Vec<EventRecord>,
    /// One entry per tick.
    pub frames: Vec<FrameRecord>,
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
    /// `grasp`, `shape` or `server`.
    pub kind: &'static str,
    /// What, in words.
    pub what: String,
}

/// One tick.
#[derive(Clone, Debug, Serialize)]
pub struct FrameRecord {
    /// Number, from 0.
    pub tick: u64,
    /// Grasp state after it.
    pub state: String,
    /// Which tips touch: thumb, index, middle, ring, little.
    pub tips: [bool; 5],
    /// Segments shown at their last free pose, by finger.
    pub recalled: [u8; 5],
    /// The solve asked for in this tick; null when nothing was asked or no answer came.
    pub solve: Option<SolveSummary>,
}

/// A run in a few numbers.
#[derive(Clone, Debug, Default, Serialize)]
pub struct RunSummary {
    /// Answers received.
    pub solves: usize,
    /// Ticks that asked.
    pub deforming_ticks: usize,
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
        pace: &'static str,
        contact: ContactModel,
    ) -> Self {
        Self {
            schema: SCHEMA,
            command: "run",
            object,
            hand,
            server,
            pace,
            contact: contact.to_string(),
            ticks: 0,
            interrupted: false,
            states_reached: Vec::new(),
            events: Vec::new(),
            frames: Vec::new(),
            summary: RunSummary::default(),
        }
    }

    /// Adds a tick.
    pub fn add(&mut self, tick: u64, outcome: &TickOutcome) {
        self.ticks = tick + 1;
        let state = outcome.state.map_or("no hand yet".to_owned(), |s| s.to_string());
        if outcome.state.is_some() && !self.states_reached.contains(&state) {
            self.states_reached.push(state.clone());
        }
        self.frames.push(FrameRecord {
            tick,
            state,
            tips: outcome.tips,
            recalled: outcome.recalled,
            solve: None,
        });
        self.add_events(tick, &outcome.events);
        for (asked_in, solve) in &outcome.answers {
            if let Some(frame) = self.frames.get_mut(*asked_in as usize) {
                frame.solve = Some(solve.clone());
            }
        }
    }

    fn add_events(&mut self, tick: u64, events: &[LoopEvent]) {
        self.events.extend(events.iter().map(|event| {
            let (kind, what) = match event {
                LoopEvent::Grasp(GraspEvent::TipTouched(finger, node)) => {
                    ("grasp", format!("{finger} touched node {node}"))
                }
                LoopEvent::Grasp(event) => ("grasp", event.to_string()),
                LoopEvent::KeepRefused(text) => ("shape", format!("keep shape refused: {text}")),
                LoopEvent::Server(text) => ("server", text.clone()),
            };
            EventRecord { tick, kind, what }
        }));
    }

    /// Fills the summary.
    pub fn finish(&mut self, faults: DeviceFaults) {
        let solves: Vec<&SolveSummary> =
            self.frames.iter().filter_map(|f| f.solve.as_ref()).collect();
        let mut round_trips: Vec<f64> = solves.iter().map(|s| s.round_trip_ms).collect();
        round_trips.sort_by(f64::total_cmp);
        let quantile = |q: f64| {
            let last = round_trips.len().checked_sub(1)?;
            round_trips.get((q * last as f64).round() as usize).copied()
        };
        let most = |of: fn(&SolveSummary) -> f64| solves.iter().map(|s| of(s)).fold(0.0, f64::max);
        let deforming = StateName::Deforming.to_string();
        let kept = GraspEvent::ShapeKept.to_string();
        self.summary = RunSummary {
            solves: solves.len(),
            deforming_ticks: self.frames.iter().filter(|f| f.state == deforming).count(),
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

    /// One screen for a person who has never seen the program.
    pub fn describe(&self) -> String {
        let s = &self.summary;
        let ms = |value: Option<f64>| value.map_or("-".to_owned(), |v| format!("{v:.2} ms"));
        let method = self.frames.iter().rev().find_map(|f| f.solve.as_ref());
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
        text.push_str("\nWhat happened:\n");
        for event in &self.events {
            text.push_str(&format!("  tick {:>5}  {}\n", event.tick, event.what));
        }
        text.push_str(&format!("\n  ticks               {}\n", self.ticks));
        text.push_str(&format!("  grasp states        {}\n", self.states_reached.join(", ")));
        text.push_str(&format!(
            "  frames deformed     {} of {} asked for\n",
            s.solves, s.deforming_ticks
        ));
        if let Some(solve) = method {
            text.push_str(&format!(
                "  equations           {} unknown, {} known, by {}\n  \
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
