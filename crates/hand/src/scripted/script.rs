//! The scripts of the scripted hand: which steps each consists of.

use std::fmt;
use std::str::FromStr;

/// Script of the scripted hand: how far it goes in grasping the object.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ScriptName {
    /// Reach for the object and go back.
    Approach,
    /// Touch with index, middle and ring finger, then let go.
    Attach,
    /// Grasp with five fingertips, squeeze, and hold to the end.
    Squeeze,
    /// Grasp, squeeze, and open the hand: the object springs back.
    Release,
    /// Grasp, squeeze, keep the shape, grasp again from another side, squeeze, open (thesis 4.6).
    #[default]
    Regrasp,
    /// Pinch the object on its table, lift it, squeeze it, keep the shape, put it down (contact with
    /// friction).
    Lift,
}

/// The text is not the name of a script.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "no script is called '{0}'; there are lift, approach, attach, squeeze, release and regrasp"
)]
pub struct UnknownScript(String);

impl ScriptName {
    /// All scripts.
    pub const ALL: [Self; 6] =
        [Self::Lift, Self::Approach, Self::Attach, Self::Squeeze, Self::Release, Self::Regrasp];

    /// The name on the command line.
    pub const fn as_str(self) -> &'static str {
        match self {
            Self::Approach => "approach",
            Self::Attach => "attach",
            Self::Squeeze => "squeeze",
            Self::Release => "release",
            Self::Regrasp => "regrasp",
            Self::Lift => "lift",
        }
    }

    /// Steps of the script, in order.
    pub(super) fn steps(self) -> Vec<Step> {
        use Step::{
            CloseOthers, CloseThree, Grip, Hold, Keep, Look, Lower, Open, Pinch, Press, Raise,
            Reach, Retreat, Squeeze, Tighten,
        };
        let squeeze = [Reach, CloseThree, CloseOthers, Press, Hold];
        match self {
            Self::Approach => vec![Reach, Hold, Retreat],
            Self::Lift => vec![
                Look, Reach, Pinch, Grip, Tighten, Raise, Hold, Squeeze, Hold, Keep, Tighten, Hold,
                Lower, Open, Retreat,
            ],
            Self::Attach => vec![Reach, CloseThree, Hold, Open, Retreat],
            Self::Squeeze => squeeze.to_vec(),
            Self::Release => [&squeeze[..], &[Open, Retreat]].concat(),
            Self::Regrasp => [
                &squeeze[..],
                &[Keep, Open, Retreat, Step::TurnToOtherSide],
                &squeeze[..],
                &[Open, Retreat],
            ]
            .concat(),
        }
    }
}

impl FromStr for ScriptName {
    type Err = UnknownScript;

    fn from_str(name: &str) -> Result<Self, UnknownScript> {
        let found = Self::ALL.into_iter().find(|script| script.as_str() == name);
        found.ok_or_else(|| UnknownScript(name.to_owned()))
    }
}

impl fmt::Display for ScriptName {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.as_str())
    }
}

/// One thing the hand does.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Step {
    Reach,
    CloseThree,
    CloseOthers,
    Press,
    /// The hand waits until the object lies still, and looks how it lies.
    Look,
    /// All fingers close at once until they touch.
    Pinch,
    /// The fingers press as deep as was planned.
    Grip,
    /// Thumb and fingers close on until they hold the object's weight by friction: before it is lifted, and
    /// once its shape is kept, which then presses back less.
    Tighten,
    /// The hand lifts what it holds.
    Raise,
    /// The fingers press deeper.
    Squeeze,
    /// The hand comes down again.
    Lower,
    Hold,
    Keep,
    Open,
    Retreat,
    TurnToOtherSide,
}

impl Step {
    /// Ticks after which the hand goes on in any case.
    pub(super) const fn ticks_max(self) -> u32 {
        match self {
            Self::Reach => 50,
            Self::CloseThree | Self::CloseOthers => 90,
            Self::Press | Self::Grip | Self::Squeeze => 50,
            Self::Look => 150,
            Self::Tighten => 120,
            Self::Pinch => 60,
            Self::Raise | Self::Lower => 70,
            Self::Hold => 15,
            Self::Keep => 1,
            Self::Open => 20,
            Self::Retreat => 25,
            Self::TurnToOtherSide => 40,
        }
    }
}
