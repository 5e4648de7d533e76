//! What mouse and keyboard ask of the hand, as plain data.

use nalgebra::{UnitQuaternion, Vector3};
use softgrasp_grasp::hand::Finger;

/// The fingers that a wish is about.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Digits {
    /// All five fingers.
    All,
    /// One finger.
    One(Finger),
}

/// One wish of the person. A wish with a number that is not finite is ignored.
///
/// The closing of a finger is 0 where it is open, 1 where the plan expects it to touch, 2 where it
/// has pressed as deep as planned, and goes on to [`super::CLOSING_MAX`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum MouseInput {
    /// Move the palm by a vector in the world, m.
    Move(Vector3<f64>),
    /// Turn the palm by a rotation in the world, about the place between its fingers.
    Turn(UnitQuaternion<f64>),
    /// Close the fingers by so much more; less than 0 opens them.
    CloseBy(Digits, f64),
    /// Close the fingers as far as this.
    CloseTo(Digits, f64),
    /// Open, and go where this object is grasped well, but a little way off.
    Aim,
    /// Open, and go near the object from another side than the last time.
    AimElsewhere,
    /// Open, and go where this object is grasped well; closing the fingers then grasps it.
    Reach,
    /// Open, and go back from the object.
    Retreat,
}

impl Digits {
    /// Whether a finger is among these, by its index, thumb first.
    pub(super) fn contain(self, digit: usize) -> bool {
        match self {
            Self::All => true,
            Self::One(finger) => finger.index() == digit,
        }
    }
}

impl MouseInput {
    /// Whether the hand is asked to go somewhere by itself.
    pub fn is_errand(&self) -> bool {
        matches!(self, Self::Aim | Self::AimElsewhere | Self::Reach | Self::Retreat)
    }

    /// Whether the numbers of the wish are finite.
    pub(super) fn is_finite(&self) -> bool {
        match self {
            Self::Move(by) => by.iter().all(|c| c.is_finite()),
            Self::Turn(by) => by.coords.iter().all(|c| c.is_finite()),
            Self::CloseBy(_, closing) | Self::CloseTo(_, closing) => closing.is_finite(),
            Self::Aim | Self::AimElsewhere | Self::Reach | Self::Retreat => true,
        }
    }
}
