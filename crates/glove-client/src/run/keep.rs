//! How far the next rest shape has come: a kept shape, or the dent that a hand has left.

use crate::object::object_work::KeptShape;

/// How far the wish to keep the shape has come.
pub(crate) enum Keep {
    /// Nobody wishes to.
    NotWanted,
    /// The next answer is asked for whole: those so far brought the surface only.
    WhenWhole,
    /// The next rest shape is being made; the object keeps the shape it has.
    BeingMade,
    /// It is made, and the grasp is told in this tick.
    Made(Box<KeptShape>),
    /// The hand let go of an object that has flowed: the shape that it springs back to is asked for.
    SpringsBack,
    /// The shape that it has sprung back to is being made the next rest shape.
    BecomesDent,
}

impl Keep {
    /// Whether the object stays as it is until its next rest shape is there.
    pub(crate) fn freezes(&self) -> bool {
        matches!(self, Self::BeingMade | Self::Made(_)) || self.is_dent()
    }

    /// Whether what is made is the dent that the hand has left.
    pub(crate) fn is_dent(&self) -> bool {
        matches!(self, Self::SpringsBack | Self::BecomesDent)
    }

    /// Whether work beside the ticks is waited for.
    pub(crate) fn awaits_work(&self) -> bool {
        matches!(self, Self::BeingMade | Self::BecomesDent)
    }
}
