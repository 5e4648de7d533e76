//! What the devices send in one tick, each byte with its time of arrival, and what the person asks for.

use serde::{Deserialize, Serialize};
use softgrasp_grasp::grasp::Command;
use softgrasp_grasp::hand::Handedness;

/// Ticks per second of a run that asks for no other rate.
pub const TICKS_PER_S: f64 = 60.0;

/// Input of one tick: device bytes and a menu command.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Sent {
    /// Bytes of the devices, in the order in which they came.
    pub arrivals: Vec<Arrival>,
    /// Menu command of the person, or of the script.
    pub command: Option<Command>,
    /// Whether the script is over and the hand rests.
    pub over: bool,
    /// What the tick did with the server's answers when it was recorded; `None` unless it is played
    /// again.
    pub recorded: Option<RecordedAnswers>,
}

impl Sent {
    /// Adds what the devices of the second hand send in the same tick. The scripts are over when both are.
    pub fn join_second(&mut self, second: Self) {
        let of_second = second.arrivals.into_iter();
        self.arrivals
            .extend(of_second.map(|arrival| Arrival { hand: WhichHand::Second, ..arrival }));
        self.command = self.command.or(second.command);
        self.over &= second.over;
    }
}

/// What a tick that is played again has to wait for, and what it must not take yet.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RecordedAnswers {
    /// Method that answered the tick's request; `None` if no tick took an answer to it.
    pub answered_by: Option<String>,
    /// Whether that answer's path at large deformation began at rest.
    pub from_rest: bool,
    /// Whether that answer said that there is no shape to which the object could spring back.
    pub springback_refused: bool,
    /// Numbers of the ticks whose answers this tick takes, in that order.
    pub taken: Vec<u64>,
    /// Whether the tick takes a rest shape that was made beside the ticks.
    pub took_work: bool,
    /// Whether the tick waits no longer for the step of a free object that an earlier tick asked for.
    pub gives_up_step: bool,
}

/// Device or sender from which bytes come.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Device {
    /// The instrumented glove.
    Glove,
    /// The tracker of the wrist.
    Tracker,
    /// A stream of joint poses.
    Joints,
}

impl Device {
    /// Name of the device in sentences.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Glove => "glove",
            Self::Tracker => "tracker",
            Self::Joints => "sender of joints",
        }
    }
}

/// One of the hands of a run.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum WhichHand {
    /// The only hand, or the one that was named first.
    #[default]
    First,
    /// The other hand.
    Second,
}

impl WhichHand {
    /// Both hands, in their order.
    pub const ALL: [Self; 2] = [Self::First, Self::Second];

    /// Position among both hands.
    pub const fn index(self) -> usize {
        match self {
            Self::First => 0,
            Self::Second => 1,
        }
    }
}

/// A device from which nothing good has come for too long.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SilentDevice {
    /// The device.
    pub device: Device,
    /// Side of its hand; `None` in a run of one hand.
    pub side: Option<Handedness>,
}

impl SilentDevice {
    /// Name of the device in sentences, with its hand where there are two.
    pub fn name(&self) -> String {
        let name = self.device.name();
        self.side.map_or(name.to_owned(), |side| format!("{} hand's {name}", side.name()))
    }
}

/// Bytes of one device that came together.
#[derive(Clone, Debug, PartialEq)]
pub struct Arrival {
    /// Hand whose devices sent the bytes. A stream that brings both hands is the first one's.
    pub hand: WhichHand,
    /// Device that sent the bytes.
    pub device: Device,
    /// When their first byte came, s on the client's clock; `None` stands for the tick that takes
    /// them: a hand that is played sends when it is looked at.
    pub at_s: Option<f64>,
    /// Whether the bytes are a datagram: what follows does not go on where they end.
    pub is_datagram: bool,
    /// The bytes, as they came.
    pub bytes: Vec<u8>,
}

impl Arrival {
    /// Bytes of a stream that come with the tick.
    pub fn with_tick(device: Device, bytes: Vec<u8>) -> Self {
        Self { hand: WhichHand::First, device, at_s: None, is_datagram: false, bytes }
    }
}
