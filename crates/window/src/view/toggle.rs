//! The parts of the scene, and the pages over it, that are shown or not.

/// A part of the scene.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Toggle {
    /// The edges of the elements on the surface.
    Wireframe,
    /// The rest shape, as a ghost.
    Ghost,
    /// The hand's skin.
    Skin,
    /// The colliders: what the search takes the hand for.
    Colliders,
    /// Marks at the nodes that the fingertips hold.
    Contacts,
    /// Arrows of the forces of the fingertips.
    Forces,
}

/// A page over the scene.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Page {
    /// Page that explains keys and mouse.
    Help,
    /// Page that says what runs and where.
    Information,
    /// Page with the graph of the times of answers.
    Timings,
    /// Page with the sliders of how soft the object is.
    Softness,
}

impl Toggle {
    /// All parts of the scene, in the order of a menu.
    pub const ALL: [Self; 6] =
        [Self::Wireframe, Self::Ghost, Self::Skin, Self::Colliders, Self::Contacts, Self::Forces];

    /// Name of the part in a menu.
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

    /// Key that shows and hides the part.
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
    /// All pages, in the order of a menu.
    pub const ALL: [Self; 4] = [Self::Help, Self::Information, Self::Timings, Self::Softness];

    /// Name of the page in a menu.
    pub const fn label(self) -> &'static str {
        match self {
            Self::Help => "Help",
            Self::Information => "Information",
            Self::Timings => "Timings",
            Self::Softness => "Softness and size",
        }
    }

    /// Key that shows and hides the page.
    pub const fn key(self) -> &'static str {
        match self {
            Self::Help => "F1",
            Self::Information => "F2",
            Self::Timings => "F3",
            Self::Softness => "F4",
        }
    }
}
