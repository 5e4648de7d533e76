//! Where the hand comes from: a script, mouse and keyboard, devices, or a recording.

use softgrasp_grasp::object::SoftObject;

use crate::foreign_recording::ForeignHand;
use crate::live_hand::LiveHand;
use crate::mouse::MouseHand;
use crate::recording::ReplayHand;
use crate::scripted::{GraspPlan, ScriptedHand, Seen};
use crate::sent::Sent;

/// A source of device bytes.
pub enum HandSource {
    /// A scripted hand.
    Scripted(ScriptedHand),
    /// A person with a mouse.
    Mouse(MouseHand),
    /// A person with a glove, or with another hand that is tracked.
    Live(Box<LiveHand>),
    /// A recording that is played again.
    Replay(ReplayHand),
    /// A recording that another program made.
    Foreign(ForeignHand),
}

impl HandSource {
    /// Moves on by the time of so many ticks and returns what the devices send then. A recording moves on
    /// by one tick, whatever was missed.
    ///
    /// Units: `now_s` s on the client's clock, now.
    pub fn next_after(&mut self, ticks: u64, now_s: f64, seen: &Seen, object: &SoftObject) -> Sent {
        match self {
            Self::Scripted(hand) => hand.next_after(ticks, seen, object),
            Self::Mouse(hand) => hand.next_after(ticks, seen, object),
            Self::Live(hand) => Sent { arrivals: hand.take(now_s), ..Sent::default() },
            Self::Foreign(hand) => hand.next_after(ticks),
            Self::Replay(hand) => match hand.next_tick() {
                Some(replayed) => replayed.sent,
                None => Sent { over: true, ..Sent::default() },
            },
        }
    }

    /// Name of the hand in reports.
    pub fn name(&self) -> String {
        match self {
            Self::Scripted(hand) => format!("scripted:{}", hand.script()),
            Self::Mouse(_) => "mouse".to_owned(),
            Self::Live(hand) => hand.name().to_owned(),
            Self::Replay(hand) => format!("replay:{}", hand.name()),
            Self::Foreign(hand) => format!("replay:{}", hand.name()),
        }
    }

    /// Whether the hand rests because its next approach is being planned.
    pub fn is_planning(&self) -> bool {
        match self {
            Self::Scripted(hand) => hand.is_planning(),
            Self::Mouse(hand) => hand.is_planning(),
            Self::Live(_) | Self::Replay(_) | Self::Foreign(_) => false,
        }
    }

    /// Plan of the hand to grasp the object, where it has one. Frame: that of the object, as if it were
    /// the world's.
    pub fn plan(&self) -> Option<GraspPlan> {
        match self {
            Self::Scripted(hand) => Some(*hand.plan()),
            Self::Mouse(hand) => hand.plan(),
            Self::Live(_) | Self::Replay(_) | Self::Foreign(_) => None,
        }
    }

    /// Whether the script of the hand is over.
    pub fn is_over(&self) -> bool {
        match self {
            Self::Scripted(hand) => hand.is_over(),
            Self::Mouse(_) | Self::Live(_) | Self::Replay(_) | Self::Foreign(_) => false,
        }
    }

    /// Whether the hand does something by itself that a person asked for, and takes no other wish.
    pub fn is_on_its_way(&self) -> bool {
        match self {
            Self::Mouse(hand) => hand.is_on_its_way(),
            Self::Scripted(_) | Self::Live(_) | Self::Replay(_) | Self::Foreign(_) => false,
        }
    }

    /// Meets another object; a script begins anew, by this plan or by one that it makes.
    pub fn meet_new_object(&mut self, plan: Option<GraspPlan>) {
        match self {
            Self::Scripted(hand) => hand.restart(plan),
            Self::Mouse(hand) => hand.meet_new_object(),
            Self::Foreign(hand) => hand.restart(),
            Self::Live(_) | Self::Replay(_) => {}
        }
    }

    /// The hand of live devices, where it is one.
    pub fn as_live(&self) -> Option<&LiveHand> {
        match self {
            Self::Live(hand) => Some(hand),
            Self::Scripted(_) | Self::Mouse(_) | Self::Replay(_) | Self::Foreign(_) => None,
        }
    }

    /// The hand of a mouse, where it is one.
    pub fn as_mouse(&mut self) -> Option<&mut MouseHand> {
        match self {
            Self::Mouse(hand) => Some(hand),
            Self::Scripted(_) | Self::Live(_) | Self::Replay(_) | Self::Foreign(_) => None,
        }
    }

    /// Whether the hand is played by the program, so that it can be paused; a person cannot.
    pub fn is_played(&self) -> bool {
        matches!(self, Self::Scripted(_) | Self::Replay(_) | Self::Foreign(_))
    }

    /// Whether the hand can go on only with a window.
    pub fn needs_window(&self) -> bool {
        matches!(self, Self::Mouse(_))
    }
}

impl From<ScriptedHand> for HandSource {
    fn from(hand: ScriptedHand) -> Self {
        Self::Scripted(hand)
    }
}

impl From<MouseHand> for HandSource {
    fn from(hand: MouseHand) -> Self {
        Self::Mouse(hand)
    }
}

impl From<ReplayHand> for HandSource {
    fn from(hand: ReplayHand) -> Self {
        Self::Replay(hand)
    }
}

impl From<LiveHand> for HandSource {
    fn from(hand: LiveHand) -> Self {
        Self::Live(Box::new(hand))
    }
}

impl From<ForeignHand> for HandSource {
    fn from(hand: ForeignHand) -> Self {
        Self::Foreign(hand)
    }
}
