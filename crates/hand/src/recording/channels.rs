//! The channels of a recording: topics, and the JSON Schema of their messages.

use serde_json::{Value, json};

use super::foxglove;
use crate::sent::{Device, WhichHand};

/// A channel of a recording: one topic in the file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Channel {
    /// How the run was set up; one message, the first.
    Setup,
    /// Raw bytes of a device of a hand.
    Device(WhichHand, Device),
    /// Pose of the hand, for other programs; a replay does not need it.
    Pose,
    /// An event of the grasp, the shape, the server or a device.
    Event,
    /// What the server was asked in a tick.
    Request,
    /// An answer of the server, as a tick took it.
    Answer,
    /// Joint angles of the hand, for other programs.
    Angles,
    /// Where palm, segments and object are, for other programs.
    Transforms,
    /// What hand and object look like, for other programs.
    Scene,
    /// Events as lines of a log, for other programs.
    Log,
    /// A tick is over; what came since the one before belongs to it.
    Tick,
}

impl Channel {
    /// All channels; those of a second hand come last, and only a run of two hands has them.
    pub const ALL: [Self; 16] = [
        Self::Setup,
        Self::Device(WhichHand::First, Device::Glove),
        Self::Device(WhichHand::First, Device::Tracker),
        Self::Device(WhichHand::First, Device::Joints),
        Self::Pose,
        Self::Event,
        Self::Request,
        Self::Answer,
        Self::Angles,
        Self::Transforms,
        Self::Scene,
        Self::Log,
        Self::Tick,
        Self::Device(WhichHand::Second, Device::Glove),
        Self::Device(WhichHand::Second, Device::Tracker),
        Self::Device(WhichHand::Second, Device::Joints),
    ];

    /// Whether the channel is of a second hand.
    pub const fn is_of_second(self) -> bool {
        matches!(self, Self::Device(WhichHand::Second, _))
    }

    /// Topic of the channel in the file.
    pub const fn topic(self) -> &'static str {
        match self {
            Self::Setup => "/setup",
            Self::Device(WhichHand::First, Device::Glove) => "/glove",
            Self::Device(WhichHand::Second, Device::Glove) => "/second/glove",
            Self::Device(WhichHand::First, Device::Tracker) => "/tracker",
            Self::Device(WhichHand::Second, Device::Tracker) => "/second/tracker",
            Self::Device(WhichHand::First, Device::Joints) => "/joints",
            Self::Device(WhichHand::Second, Device::Joints) => "/second/joints",
            Self::Pose => "/pose",
            Self::Event => "/event",
            Self::Request => "/request",
            Self::Answer => "/answer",
            Self::Angles => "/joint_angles",
            Self::Transforms => "/tf",
            Self::Scene => "/scene",
            Self::Log => "/log",
            Self::Tick => "/tick",
        }
    }

    /// The channel of a topic.
    pub fn of_topic(topic: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|channel| channel.topic() == topic)
    }

    /// Name of the schema of the channel's messages.
    pub const fn schema_name(self) -> &'static str {
        match self {
            Self::Setup => "softgrasp.Setup",
            Self::Device(..) => "softgrasp.DeviceBytes",
            Self::Pose => "softgrasp.HandPose",
            Self::Event => "softgrasp.Event",
            Self::Request => "softgrasp.Request",
            Self::Answer => "softgrasp.Answer",
            Self::Angles => "softgrasp.JointAngles",
            Self::Transforms => foxglove::TRANSFORMS,
            Self::Scene => foxglove::SCENE,
            Self::Log => foxglove::LOG,
            Self::Tick => "softgrasp.Tick",
        }
    }

    /// JSON Schema of the channel's messages.
    pub fn schema(self) -> Value {
        let number = json!({"type": "number"});
        let integer = json!({"type": "integer"});
        let text = json!({"type": "string"});
        let flag = json!({"type": "boolean"});
        let list = |of: &Value| json!({"type": "array", "items": of});
        let properties = match self {
            Self::Setup => json!({
                "version": integer, "program": text, "object": text, "nodes": integer,
                "size_m": {"type": ["number", "null"]}, "mesh": text, "young_pa": number, "poisson": number,
                "regions": {"type": "array", "items": {"type": "object"}},
                "element": text, "method": text, "contact": text, "whole": flag, "hand": text,
                "deformation": text, "law": text, "yield_pa": {"type": ["number", "null"]},
                "max_error": {"type": ["number", "null"]},
                "period_s": {"type": ["number", "null"]}, "hand_setup": text,
                "calibration": text, "is_live": flag, "is_even": flag,
                "world_from_sender": {"type": ["array", "null"], "items": number},
                "second_hand": {"type": "object"},
            }),
            Self::Device(..) => json!({
                "at_s": {"type": ["number", "null"]}, "datagram": flag, "hex": text,
            }),
            Self::Pose => json!({
                "tick": integer, "palm_m": list(&number), "palm_xyzw": list(&number),
                "fingertips_m": list(&list(&number)), "object_m": list(&number),
                "object_xyzw": list(&number),
            }),
            Self::Event => json!({"tick": integer, "kind": text, "what": text}),
            Self::Request => json!({
                "tick": integer, "digest": text,
            }),
            Self::Answer => json!({
                "tick": integer, "method": text, "element": text, "residual_rel": number,
                "round_trip_ms": number, "from_rest": flag,
            }),
            Self::Angles => json!({"tick": integer, "names": list(&text), "rad": list(&number)}),
            Self::Transforms | Self::Scene | Self::Log => {
                return foxglove::schema(self.schema_name());
            }
            Self::Tick => json!({
                "tick": integer, "skipped": integer, "now_s": number,
                "command": {"type": ["string", "null"]}, "interventions": list(&json!({})),
                "answers": list(&integer), "took_work": flag, "gave_up_step": flag,
                "state": {"type": ["string", "null"]},
                "contacts": list(&json!({"type": ["integer", "null"]})),
                "stages": {"type": "object", "properties": {
                    "pose": text, "contacts": text, "request": text, "displacement": text,
                }},
            }),
        };
        json!({"type": "object", "title": self.schema_name(), "properties": properties})
    }
}
