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
    /// No finger touches the object.
    Free {
        /// Last free poses of the segments in the object's frame, m.
        last_free: HandSegments,
    },
    /// Some finger penetrates the rigid object and is shown at its last free pose (thesis 4.5.3).
    Avoiding {
        /// Last free poses of the segments in the object's frame, m.
        last_free: HandSegments,
        /// Number of recalled segments of each finger, thumb first; at least one is not 0.
        recalled: [u8; 5],
    },
    /// The rigid object follows the palm (thesis 4.5.2).
    Attached {
        /// Pose of the object in the palm frame, kept since the attachment.
        palm_from_object: Isometry3<f64>,
        /// Whether each fingertip holds, thumb first: at least one of index, middle and ring finger, and
        /// not all five.
        holds: [Hold; 5],
        /// Last free poses of the segments in the object's frame, m.
        last_free: HandSegments,
        /// Number of recalled segments of each finger, thumb first; 3 for every held finger.
        recalled: [u8; 5],
    },
    /// All five tips hold, and their motion deforms the object (thesis 4.5.1).
    Deforming {
        /// Pose of the object in the palm frame, kept since the attachment.
        palm_from_object: Isometry3<f64>,
        /// Contacts of the five tips, thumb first, on five different nodes.
        contacts: [Contact; 5],
        /// Last free poses of the segments in the object's frame, m, as of the attachment.
        last_free: HandSegments,
    },
    /// Contacts are ignored until the hand is clear of the object.
    Detached,
}

/// One fingertip in `Attached`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Hold {
    /// The tip holds nothing, and touches as soon as it is inside the object.
    Open,
    /// The tip is in contact with a node.
    Held(Contact),
    /// The tip has left its contact; it must be seen outside once before it can touch again.
    Left,
}

/// Contact of a fingertip with a node.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Contact {
    /// Number of the mesh node, which no other finger holds.
    pub node: u32,
    /// Contact point of the tip when it touched, m; displacements count from here.
    pub tip_at_contact_in_object: Point3<f64>,
    /// Outward unit normal of the surface at the node.
    pub normal_in_object: Vector3<f64>,
}

/// The states by name.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum StateName {
    /// State [`GraspState::Free`].
    Free,
    /// State [`GraspState::Avoiding`].
    Avoiding,
    /// State [`GraspState::Attached`].
    Attached,
    /// State [`GraspState::Deforming`].
    Deforming,
    /// State [`GraspState::Detached`].
    Detached,
}

impl GraspState {
    /// Name of the state.
    pub fn name(&self) -> StateName {
        match self {
            Self::Free { .. } => StateName::Free,
            Self::Avoiding { .. } => StateName::Avoiding,
            Self::Attached { .. } => StateName::Attached,
            Self::Deforming { .. } => StateName::Deforming,
            Self::Detached => StateName::Detached,
        }
    }

    /// Contact of each fingertip, thumb first; `None` for all of them unless the object is attached.
    pub fn contacts(&self) -> [Option<Contact>; 5] {
        match self {
            Self::Attached { holds, .. } => holds.map(|hold| hold.contact().copied()),
            Self::Deforming { contacts, .. } => contacts.map(Some),
            Self::Free { .. } | Self::Avoiding { .. } | Self::Detached => [None; 5],
        }
    }
}

impl Hold {
    /// The contact, if the tip holds a node.
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
