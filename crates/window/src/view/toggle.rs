//! The parts of the scene, and the pages over it, that are shown or not.

/// A part of the scene.
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
}

/// A page over the scene.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Page {
    /// Explains keys and mouse.
    Help,
    /// Says what runs and where.
    Information,
    /// The graph of times.
    Timings,
    /// How soft the object is.
    Softness,
}

impl Toggle {
    /// All of them, in the order of a menu.
    pub const ALL: [Self; 6] =
        [Self::Wireframe, Self::Ghost, Self::Skin, Self::Colliders, Self::Contacts, Self::Forces];

    /// What the menu calls it.
    pub const fn label(self) -> &'static str {
        match self {
            Self::Wireframe => "Elements",
            Self::Ghost => "Shape at rest",
            Self::Skin => "Hand",
            Self::Colliders => "Colliders",
            Self::Contacts => "Contacts",
            Self::Forces => "Forces",
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
        }
    }
}

impl Page {
    /// All of them, in the order of a menu.
    pub const ALL: [Self; 4] = [Self::Help, Self::Information, Self::Timings, Self::Softness];

    /// What the menu calls it.
    pub const fn label(self) -> &'static str {
        match self {
            Self::Help => "Help",
            Self::Information => "Information",
            Self::Timings => "Timings",
            Self::Softness => "Softness and size",
        }
    }

    /// Its key.
    pub const fn key(self) -> &'static str {
        match self {
            Self::Help => "F1",
            Self::Information => "F2",
            Self::Timings => "F3",
            Self::Softness => "F4",
        }
    }
}
