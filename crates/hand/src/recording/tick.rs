//! What a recording holds: how the run was set up, and each tick.

use serde::{Deserialize, Serialize};

use super::stages::StageDigests;
use crate::arrival::Arrival;

/// How a recorded run was set up: enough to play it again.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RecordedSetup {
    /// Version of the recording's messages.
    pub version: u32,
    /// Program that wrote it.
    pub program: String,
    /// Built-in object or mesh file.
    pub object: String,
    /// Nodes asked of a built-in object.
    pub nodes: usize,
    /// Longest extent that the object was brought to, m; `None` for one of its own size.
    pub size_m: Option<f64>,
    /// Digest of its mesh.
    pub mesh: String,
    /// Young's modulus, Pa.
    pub young_pa: f64,
    /// Poisson's ratio.
    pub poisson: f64,
    /// Finite element.
    pub element: String,
    /// Method asked for.
    pub method: String,
    /// What a fingertip holds.
    pub contact: String,
    /// Whether each tick asked for every node.
    pub whole: bool,
    /// Equations: `linear`, `large` or `auto`; recordings from before there was a choice are linear.
    #[serde(default = "linear")]
    pub deformation: String,
    /// Law of large deformation; empty where there was no choice.
    #[serde(default)]
    pub law: String,
    /// Yield stress, Pa.
    #[serde(default)]
    pub yield_pa: Option<f64>,
    /// Largest relative error asked for.
    #[serde(default)]
    pub max_error: Option<f64>,
    /// Where the hand came from.
    pub hand: String,
    /// From tick to tick in real time, s.
    pub period_s: Option<f64>,
    /// Hand, glove, tracker and their places (TOML, `docs/devices.md`).
    pub hand_setup: String,
    /// Calibration of the glove (TOML).
    pub calibration: String,
    /// Whether devices sent what they would, so that the form of their records was found out.
    pub is_live: bool,
    /// Where a sender of joints was placed: m, then quaternion x y z w; `None` where its first hand
    /// was placed before the object.
    pub world_from_sender: Option<[f64; 7]>,
}

fn linear() -> String {
    "linear".to_owned()
}

/// What a person did to the object between two ticks.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Intervention {
    /// Turned it about its centre; quaternion x, y, z, w, world frame.
    Turn([f64; 4]),
    /// Took the last kept shape back.
    UndoKeepShape,
    /// Something that a replay cannot repeat, in words.
    NotReplayed(String),
}

/// One tick, as it was played.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct TickSeen {
    /// Its number.
    pub tick: u64,
    /// Ticks before it that were not played.
    pub skipped: u64,
    /// Time of the client's clock, s.
    pub now_s: f64,
    /// Command of the menu.
    pub command: Option<String>,
    /// What was done to the object before it.
    #[serde(default)]
    pub interventions: Vec<Intervention>,
    /// Ticks whose answers it took, in that order.
    pub answers: Vec<u64>,
    /// Whether it took a rest shape that was made beside the ticks.
    pub took_work: bool,
    /// State of the grasp after it.
    pub state: Option<String>,
    /// Node that each fingertip holds, thumb first.
    pub contacts: [Option<u32>; 5],
    /// What its stages made.
    pub stages: StageDigests,
}

/// An answer of the server, as a tick took it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct AnswerSeen {
    /// Tick that asked.
    pub tick: u64,
    /// Method that answered.
    pub method: String,
    /// Element that answered.
    pub element: String,
    /// Relative residual.
    pub residual_rel: f64,
    /// From asking to taking, ms.
    pub round_trip_ms: f64,
}

/// Something that happened in a tick.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct EventSeen {
    /// `grasp`, `shape`, `server` or `device`.
    pub kind: &'static str,
    /// What, in words.
    pub what: String,
}

/// Where the hand and the object were in a tick.
///
/// Units: m; quaternions x, y, z, w. Frame: the world.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PoseSeen {
    /// The tick.
    pub tick: u64,
    /// The palm.
    pub palm_m: [f64; 3],
    /// How it is turned.
    pub palm_xyzw: [f64; 4],
    /// The fingertips, thumb first.
    pub fingertips_m: [[f64; 3]; 5],
    /// The object.
    pub object_m: [f64; 3],
    /// How it is turned.
    pub object_xyzw: [f64; 4],
}

/// A tick of a recording, with the bytes that it took.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RecordedTick {
    /// What was seen of it.
    pub seen: TickSeen,
    /// The bytes, in the order in which they were taken.
    pub arrivals: Vec<Arrival>,
    /// Method that answered what it asked; `None` if no tick took an answer to it.
    pub answered_by: Option<String>,
}
