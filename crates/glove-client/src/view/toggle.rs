//! The things of the scene that are shown or not.

/// Something that is shown or not.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Toggle {
    /// The edges of the elements.
    Wireframe,
    /// The shape at rest.
    Ghost,
    /// The hand's skin.
    Skin,
    /// What the search takes the hand for.
    Colliders,
    /// Where the tips hold.
    Contacts,
    /// How hard they press.
    Forces,
    /// The page that explains keys and mouse.
    Help,
    /// The page that says what runs and where.
    Information,
    /// The graph of times.
    Timings,
}

impl Toggle {
    /// What the menu calls it.
    pub const fn label(self) -> &'static str {
        match self {
            Self::Wireframe => "Elements",
            Self::Ghost => "Shape at rest",
            Self::Skin => "Hand",
            Self::Colliders => "Colliders",
            Self::Contacts => "Contacts",
            Self::Forces => "Forces",
            Self::Help => "Help",
            Self::Information => "Information",
            Self::Timings => "Timings",
        }
    }

    /// Its key.
    pub const fn key(self) -> &'static str {
        match self {
            Self::Wireframe => "W",
            Self::Ghost => "G",
            Self::Skin => "H",
            Self::Colliders => "L",
            Self::Contacts => "O",
            Self::Forces => "N",
            Self::Help => "F1",
            Self::Information => "F2",
            Self::Timings => "F3",
        }
    }
}
