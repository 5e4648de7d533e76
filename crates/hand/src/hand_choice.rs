//! Which kind of hand acts.

use crate::scripted::ScriptName;

/// Where the hand comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum HandChoice {
    /// Played by the program, as device bytes.
    Scripted(ScriptName),
    /// Driven by mouse and keyboard, in a window.
    Mouse,
    /// A person's own hand, through a glove and a tracker, or tracked otherwise.
    Live,
    /// A recording that is played again.
    Replay,
}

impl HandChoice {
    /// Whether it is played, so that it can be paused; a person cannot.
    pub fn is_played(self) -> bool {
        matches!(self, Self::Scripted(_) | Self::Replay)
    }
}
