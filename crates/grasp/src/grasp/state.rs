//! The states of a grasp, each with the data that only it needs.

use nalgebra::{Isometry3, Point3, Vector3};

/// Poses of three segments of five fingers: thumb first, from the palm outward.
pub type HandSegments = [[Isometry3<f64>; 3]; 5];

/// What the hand and the object are to each other.
///
/// `last_free` are segment poses in the object's frame, so that a finger recalled to its last free
/// pose stays outside the object while the object follows the palm.
/// `recalled` counts, per finger, the segments from the palm that are shown there (0 to 3).
#[derive(Clone, Debug, PartialEq)]
pub enum GraspState {
    /// Nothing touches.
    Free {
        /// Object from segment.
        last_free: HandSegments,
    },
    /// Some finger penetrates the rigid object and is shown at its last free pose (thesis 4.5.3).
    Avoiding {
        /// Object from segment.
        last_free: HandSegments,
        /// At least one is not 0.
        recalled: [u8; 5],
    },
    /// The rigid object follows the palm (thesis 4.5.2).
    Attached {
        /// Pose of the object kept since the attachment.
        palm_from_object: Isometry3<f64>,
        /// At least one of index, middle and ring is held, and not all five are.
        holds: [Hold; 5],
        /// Object from segment.
        last_free: HandSegments,
        /// 3 for every held finger.
        recalled: [u8; 5],
    },
    /// All five tips hold, and their motion deforms the object (thesis 4.5.1).
    Deforming {
        /// Pose of the object kept since the attachment.
        palm_from_object: Isometry3<f64>,
        /// On five different nodes.
        contacts: [Contact; 5],
        /// Object from segment, as of the attachment.
        last_free: HandSegments,
    },
    /// Contacts are ignored until the hand is clear of the object.
    Detached,
}

/// One fingertip in `Attached`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Hold {
    /// Touches as soon as the tip is inside.
    Open,
    /// In contact.
    Held(Contact),
    /// Left its contact; must be seen outside once before it can touch again.
    Left,
}

/// A fingertip on a node.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Contact {
    /// Mesh node, no other finger's.
    pub node: u32,
    /// Where the tip was when it touched; displacements count from here.
    pub tip_at_contact_in_object: Point3<f64>,
    /// Unit vertex normal there, outward.
    pub normal_in_object: Vector3<f64>,
}

/// The states by name.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum StateName {
    /// See [`GraspState::Free`].
    Free,
    /// See [`GraspState::Avoiding`].
    Avoiding,
    /// See [`GraspState::Attached`].
    Attached,
    /// See [`GraspState::Deforming`].
    Deforming,
    /// See [`GraspState::Detached`].
    Detached,
}

impl GraspState {
    /// Its name.
    pub fn name(&self) -> StateName {
        match self {
            Self::Free { .. } => StateName::Free,
            Self::Avoiding { .. } => StateName::Avoiding,
            Self::Attached { .. } => StateName::Attached,
            Self::Deforming { .. } => StateName::Deforming,
            Self::Detached => StateName::Detached,
        }
    }

    /// What each fingertip holds, thumb first; nothing unless the object is attached.
    pub fn contacts(&self) -> [Option<Contact>; 5] {
        match self {
            Self::Attached { holds, .. } => holds.map(|hold| hold.contact().copied()),
            Self::Deforming { contacts, .. } => contacts.map(Some),
            Self::Free { .. } | Self::Avoiding { .. } | Self::Detached => [None; 5],
        }
    }
}

impl Hold {
    /// The contact, if there is one.
    pub fn contact(&self) -> Option<&Contact> {
        match self {
            Self::Held(contact) => Some(contact),
            Self::Open | Self::Left => None,
        }
    }
}

impl std::fmt::Display for StateName {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{self:?}")
    }
}
