//! Where the hand comes from: a script, or mouse and keyboard.

use crate::mouse::MouseHand;
use crate::scripted::{ScriptedHand, Seen, Sent};
use crate::soft_object::SoftObject;

/// A source of device bytes.
pub enum HandSource {
    /// A script that is played.
    Scripted(ScriptedHand),
    /// A person with a mouse.
    Mouse(MouseHand),
}

impl HandSource {
    /// Moves on by the time of so many ticks and says what the devices send then.
    pub fn next_after(&mut self, ticks: u64, seen: &Seen, object: &SoftObject) -> Sent {
        match self {
            Self::Scripted(hand) => hand.next_after(ticks, seen, object),
            Self::Mouse(hand) => hand.next_after(ticks, seen, object),
        }
    }

    /// Its name in reports.
    pub fn name(&self) -> String {
        match self {
            Self::Scripted(hand) => format!("scripted:{}", hand.script()),
            Self::Mouse(_) => "mouse".to_owned(),
        }
    }

    /// Whether the hand rests because its next approach is being planned.
    pub fn is_planning(&self) -> bool {
        match self {
            Self::Scripted(hand) => hand.is_planning(),
            Self::Mouse(hand) => hand.is_planning(),
        }
    }

    /// Whether it is played, so that it can be paused and played again; a person cannot.
    pub fn is_played(&self) -> bool {
        matches!(self, Self::Scripted(_))
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
