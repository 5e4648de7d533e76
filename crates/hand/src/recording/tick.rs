//! What a recording holds: how the run was set up, and each tick.

use nalgebra::{Isometry3, Point3};
use serde::{Deserialize, Serialize};
use softgrasp_grasp::hand::{ANGLE_COUNT, HandDimensions};

use super::stages::StageDigests;
use crate::sent::Arrival;

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
    /// A grasp by contact with friction; `None` where the thesis's rules hold.
    #[serde(default)]
    pub friction: Option<RecordedFriction>,
    /// Whether the object was put in front of the first hand.
    #[serde(default)]
    pub placed_in_hand: bool,
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

/// What a grasp by contact with friction was like.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RecordedFriction {
    /// Coefficient of friction of hand and table.
    pub friction: f64,
    /// How far a finger gives way to a force, m/N.
    pub finger_compliance_m_n: f64,
    /// Density of the object, kg/m³.
    pub density_kg_m3: f64,
    /// Time in which the shape forgets a force, s.
    pub viscosity_s: f64,
    /// Acceleration of free fall, m/s², world.
    pub gravity: [f64; 3],
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
    /// Whether it gave up the step of a free object that an earlier tick had asked for: the server was
    /// lost, or refused it.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub gave_up_step: bool,
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
    /// Whether its path at large deformation began at rest. A server that was started anew in the
    /// middle of a grip begins there; a replay asks for the same.
    #[serde(default)]
    pub from_rest: bool,
}

/// Method of an answer of which it is recorded that there was no shape to spring back to.
pub const SPRINGBACK_REFUSED: &str = "springback refused";

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

/// Hand and object of a tick, for programs that draw them; a replay does not need it.
#[derive(Clone, Debug, PartialEq)]
pub struct SceneSeen {
    /// Where they were.
    pub pose: PoseSeen,
    /// The hand.
    pub hand: HandSeen,
    /// Where the object was.
    pub world_from_object: Isometry3<f64>,
    /// Its surface, now and then.
    pub surface: Option<SurfaceSeen>,
}

/// The hand of a tick, as it was measured.
///
/// Units: m. Frame: world.
#[derive(Clone, Debug, PartialEq)]
pub struct HandSeen {
    /// The palm.
    pub world_from_palm: Isometry3<f64>,
    /// The segments, thumb first, from the palm outward, +Y along the bone.
    pub world_from_segments: [[Isometry3<f64>; 3]; 5],
    /// Joint angles in the order of `JointAngles::to_array`, rad.
    pub angles_rad: [f64; ANGLE_COUNT],
    /// Its size.
    pub dimensions: HandDimensions,
}

/// The deformed surface of the object.
///
/// Units: m. Frame: the object's.
#[derive(Clone, Debug, PartialEq)]
pub struct SurfaceSeen {
    /// Its nodes.
    pub points: Vec<Point3<f64>>,
    /// Three of these points each, counter-clockwise from outside.
    pub triangles: Vec<[u32; 3]>,
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
    /// Whether that answer's path at large deformation began at rest.
    pub from_rest: bool,
    /// Whether it found that there was no shape that the object could spring back to.
    pub springback_refused: bool,
}
