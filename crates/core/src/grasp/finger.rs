//! The five fingers in the order every array of fingers uses.

/// Finger of one hand, from the thumb outward.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Finger {
    /// Watched only after the object is attached.
    Thumb,
    /// The thesis's first finger.
    Index,
    /// The long finger.
    Middle,
    /// Between middle and little finger.
    Ring,
    /// The thesis's last finger; watched only after the object is attached.
    Little,
}

impl Finger {
    /// All five, in array order.
    pub const ALL: [Self; 5] = [Self::Thumb, Self::Index, Self::Middle, Self::Ring, Self::Little];

    /// Place in arrays of five, 0 for the thumb.
    pub fn index(self) -> usize {
        self as usize
    }

    /// Whether this is one of the three fingers whose common touch attaches the object.
    ///
    /// Source: thesis 4.5.2.
    pub fn attaches(self) -> bool {
        matches!(self, Self::Index | Self::Middle | Self::Ring)
    }
}

impl std::fmt::Display for Finger {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(["thumb", "index", "middle", "ring", "little"][self.index()])
    }
}
