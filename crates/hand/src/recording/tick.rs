//! What a recording holds: how the run was set up, and each tick.

use nalgebra::{Isometry3, Point3};
use serde::{Deserialize, Serialize};
use softgrasp_grasp::hand::{ANGLE_COUNT, HandDimensions};

use super::stages::StageDigests;
use crate::sent::{Arrival, TICKS_PER_S};

/// How a recorded run was set up: enough to play it again.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RecordedSetup {
    /// Version of the recording's messages.
    pub version: u32,
    /// Name and version of the program that wrote the recording.
    pub program: String,
    /// Name of a built-in object, or its mesh file.
    pub object: String,
    /// Number of nodes asked of a built-in object.
    pub nodes: usize,
    /// Longest extent that the object was brought to, m; `None` for one of its own size.
    pub size_m: Option<f64>,
    /// Digest of the object's mesh.
    pub mesh: String,
    /// Young's modulus, Pa.
    pub young_pa: f64,
    /// Poisson's ratio.
    pub poisson: f64,
    /// Regions of the mesh with a material of their own.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub regions: Vec<RecordedRegion>,
    /// Name of the finite element.
    pub element: String,
    /// Name of the method that was asked for.
    pub method: String,
    /// Name of the contact model: what a fingertip holds.
    pub contact: String,
    /// Whether each tick asked for the displacement of every node.
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
    /// Whether the object was placed before the first hand.
    #[serde(default)]
    pub placed_in_hand: bool,
    /// Name of the hand that acted, as in reports.
    pub hand: String,
    /// Real time from tick to tick, s.
    pub period_s: Option<f64>,
    /// Hand, glove, tracker and their places (TOML, `docs/devices.md`).
    pub hand_setup: String,
    /// Calibration of the glove (TOML).
    pub calibration: String,
    /// Whether devices sent what they would, so that the form of their records was found out.
    pub is_live: bool,
    /// Whether the hand moved evenly between its samples; not in recordings from before it could.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub is_even: bool,
    /// Where a sender of joints was placed: m, then quaternion x y z w; `None` where its first hand
    /// was placed before the object.
    pub world_from_sender: Option<[f64; 7]>,
    /// The second hand; `None` in a run of one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub second_hand: Option<RecordedHand>,
}

impl RecordedSetup {
    /// Time from tick to tick in which the recorded hand moved, s.
    pub fn tick_s(&self) -> f64 {
        self.period_s.unwrap_or(1.0 / TICKS_PER_S)
    }
}

/// How the second hand of a recorded run was set up.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RecordedHand {
    /// Hand, glove, tracker and their places (TOML, `docs/devices.md`).
    pub hand_setup: String,
    /// Calibration of the glove (TOML).
    pub calibration: String,
    /// Whether devices sent what they would, so that the form of their records was found out.
    pub is_live: bool,
    /// Whether the hand moved evenly between its samples.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub is_even: bool,
    /// Whether the hand came in the first one's stream of joints, which carries both.
    pub shares_stream: bool,
    /// Where a sender of its joints was placed, as [`RecordedSetup::world_from_sender`].
    pub world_from_sender: Option<[f64; 7]>,
}

/// A region of the object's mesh with a material of its own.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RecordedRegion {
    /// Name of the region in the mesh file, or of what the ellipsoid holds.
    pub name: String,
    /// Young's modulus, Pa.
    pub young_pa: f64,
    /// Poisson's ratio.
    pub poisson: f64,
    /// Centre and half axes of the ellipsoid in which the region lies, m, in the object's frame; `None` where the
    /// mesh file says where it is.
    pub ellipsoid_m: Option<[[f64; 3]; 2]>,
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
    /// Another change of the object, in words, which a replay cannot repeat.
    NotReplayed(String),
}

/// One tick, as it was played.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct TickSeen {
    /// Number of the tick.
    pub tick: u64,
    /// Number of ticks before it that were not played.
    pub skipped: u64,
    /// Time of the client's clock, s.
    pub now_s: f64,
    /// Menu command of the person, by its name.
    pub command: Option<String>,
    /// What a person did to the object before the tick.
    #[serde(default)]
    pub interventions: Vec<Intervention>,
    /// Numbers of the ticks whose answers this tick took, in that order.
    pub answers: Vec<u64>,
    /// Whether the tick took a rest shape that was made beside the ticks.
    pub took_work: bool,
    /// Whether the tick gave up the step of a free object that an earlier tick had asked for: the server
    /// was lost, or refused it.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub gave_up_step: bool,
    /// State of the grasp after the tick.
    pub state: Option<String>,
    /// Node that each fingertip holds, thumb first.
    pub contacts: [Option<u32>; 5],
    /// Digests of what the stages of the tick made.
    pub stages: StageDigests,
}

/// An answer of the server, as a tick took it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct AnswerSeen {
    /// Number of the tick that asked.
    pub tick: u64,
    /// Name of the method that answered.
    pub method: String,
    /// Name of the finite element that answered.
    pub element: String,
    /// Relative residual of the answer.
    pub residual_rel: f64,
    /// Time from the request to the tick that took the answer, ms.
    pub round_trip_ms: f64,
    /// Whether the answer's path at large deformation began at rest. A server that was started anew in
    /// the middle of a grip begins there; a replay asks for the same.
    #[serde(default)]
    pub from_rest: bool,
}

/// Method of an answer of which it is recorded that there was no shape to spring back to.
pub const SPRINGBACK_REFUSED: &str = "springback refused";

/// An event that happened in a tick.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct EventSeen {
    /// `grasp`, `shape`, `server` or `device`.
    pub kind: &'static str,
    /// What happened, in words.
    pub what: String,
}

/// Where the hand and the object were in a tick.
///
/// Units: m; quaternions x, y, z, w. Frame: the world.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PoseSeen {
    /// Number of the tick.
    pub tick: u64,
    /// Origin of the palm frame.
    pub palm_m: [f64; 3],
    /// Orientation of the palm.
    pub palm_xyzw: [f64; 4],
    /// Ends of the fingertips, thumb first.
    pub fingertips_m: [[f64; 3]; 5],
    /// Origin of the object's frame.
    pub object_m: [f64; 3],
    /// Orientation of the object.
    pub object_xyzw: [f64; 4],
}

/// Hands and object of a tick, for programs that draw them; a replay does not need it.
#[derive(Clone, Debug, PartialEq)]
pub struct SceneSeen {
    /// Palm and fingertips of the first hand, and the object, as numbers for other programs; `None` without
    /// that hand.
    pub pose: Option<PoseSeen>,
    /// Poses, angles and dimensions of the hands that are there.
    pub hands: [Option<HandSeen>; 2],
    /// Pose of the object in the world.
    pub world_from_object: Isometry3<f64>,
    /// Deformed surface of the object, in some of the ticks.
    pub surface: Option<SurfaceSeen>,
}

/// The hand of a tick, as it was measured.
///
/// Units: m. Frame: world.
#[derive(Clone, Debug, PartialEq)]
pub struct HandSeen {
    /// Pose of the palm.
    pub world_from_palm: Isometry3<f64>,
    /// Poses of the segments, thumb first, from the palm outward, +Y along the bone.
    pub world_from_segments: [[Isometry3<f64>; 3]; 5],
    /// Joint angles in the order of `JointAngles::to_array`, rad.
    pub angles_rad: [f64; ANGLE_COUNT],
    /// Dimensions of the hand.
    pub dimensions: HandDimensions,
}

/// The deformed surface of the object.
///
/// Units: m. Frame: the object's.
#[derive(Clone, Debug, PartialEq)]
pub struct SurfaceSeen {
    /// Nodes of the surface.
    pub points: Vec<Point3<f64>>,
    /// Three of these points each, counter-clockwise from outside.
    pub triangles: Vec<[u32; 3]>,
}

/// A tick of a recording, with the bytes that it took.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RecordedTick {
    /// The tick as its message has it.
    pub seen: TickSeen,
    /// Device bytes, in the order in which the tick took them.
    pub arrivals: Vec<Arrival>,
    /// Method that answered the tick's request; `None` if no tick took an answer to it.
    pub answered_by: Option<String>,
    /// Whether that answer's path at large deformation began at rest.
    pub from_rest: bool,
    /// Whether that answer said that there is no shape to which the object could spring back.
    pub springback_refused: bool,
}
