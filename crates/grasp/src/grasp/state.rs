//! The states of a grasp, each with the data that only it needs.

use nalgebra::{Isometry3, Point3, Vector3};

/// Poses of three segments of five fingers: thumb first, from the palm outward.
pub type HandSegments = [[Isometry3<f64>; 3]; 5];

/// One object and the hand that may hold it.
///
/// Starts `Detached`, so a hand that begins inside the object has to leave it first.
#[derive(Clone, Debug, PartialEq)]
pub struct Grasp {
    pub(super) state: GraspState,
    pub(super) world_from_object: Isometry3<f64>,
    pub(super) home: Isometry3<f64>,
    pub(super) release_margin: f64,
}

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

/// Why a grasp cannot be set up.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum GraspError {
    /// The margin is no distance.
    #[error("the release margin is {metres} m; it must be a finite number, at least 0")]
    Margin {
        /// Margin given.
        metres: f64,
    },
    /// An object in the hand stays where the hand has it.
    #[error("a hand holds the object; let it go first")]
    Held,
    /// A pose with a number that is not finite.
    #[error("the object's pose is not finite")]
    Pose,
}

impl Grasp {
    /// Margin at which a tip lets go: three times the noise of one sensor count at a fingertip.
    pub const RELEASE_MARGIN_M: f64 = 0.003;

    /// A grasp of an object that rests at `home` (world from object).
    ///
    /// Units: `release_margin` m; see [`Grasp::RELEASE_MARGIN_M`].
    ///
    /// # Errors
    /// [`GraspError::Margin`] if the margin is negative or not finite.
    pub fn try_new(home: Isometry3<f64>, release_margin: f64) -> Result<Self, GraspError> {
        if !(release_margin >= 0.0 && release_margin.is_finite()) {
            return Err(GraspError::Margin { metres: release_margin });
        }
        Ok(Self { state: GraspState::Detached, world_from_object: home, home, release_margin })
    }

    /// The state after the last tick.
    pub fn state(&self) -> &GraspState {
        &self.state
    }

    /// The margin, m; the same one is for [`super::sense`].
    pub fn release_margin(&self) -> f64 {
        self.release_margin
    }

    /// Where the object returns to (world from object).
    pub fn home(&self) -> &Isometry3<f64> {
        &self.home
    }

    /// Whether the object follows the palm.
    pub fn is_held(&self) -> bool {
        matches!(self.state, GraspState::Attached { .. } | GraspState::Deforming { .. })
    }

    /// Lets go of the object where it is, between two ticks; a hand inside it has to leave it first.
    ///
    /// For a hand or an object that is replaced. What a user asks for in a tick is a
    /// [`super::Command`].
    pub fn let_go(&mut self) {
        self.state = GraspState::Detached;
    }

    /// Puts the object, which nothing holds, somewhere else, between two ticks. Fingers that avoid
    /// it stay where they are shown in the world.
    ///
    /// Source: thesis 6.1.2, the mouse turns the object.
    ///
    /// # Errors
    /// [`GraspError::Held`] while the object follows the palm, [`GraspError::Pose`] for a pose that
    /// is not finite; nothing has changed then.
    pub fn place(&mut self, world_from_object: Isometry3<f64>) -> Result<(), GraspError> {
        let Isometry3 { rotation, translation } = &world_from_object;
        let mut numbers = rotation.coords.iter().chain(translation.vector.iter());
        if !numbers.all(|number| number.is_finite()) {
            return Err(GraspError::Pose);
        }
        let now_from_before = world_from_object.inverse() * self.world_from_object;
        match &mut self.state {
            GraspState::Attached { .. } | GraspState::Deforming { .. } => {
                return Err(GraspError::Held);
            }
            GraspState::Free { last_free } | GraspState::Avoiding { last_free, .. } => {
                *last_free =
                    last_free.map(|finger| finger.map(|segment| now_from_before * segment));
            }
            GraspState::Detached => {}
        }
        self.world_from_object = world_from_object;
        Ok(())
    }

    /// Another home, where the object, which nothing holds, is put at once.
    ///
    /// # Errors
    /// As [`Grasp::place`].
    pub fn set_home(&mut self, world_from_home: Isometry3<f64>) -> Result<(), GraspError> {
        self.place(world_from_home)?;
        self.home = world_from_home;
        Ok(())
    }

    /// Where the object is when the palm is at `world_from_palm`: it follows while it is attached.
    ///
    /// Sense against this pose, then step with the same palm pose.
    pub fn world_from_object(&self, world_from_palm: &Isometry3<f64>) -> Isometry3<f64> {
        match &self.state {
            GraspState::Attached { palm_from_object, .. }
            | GraspState::Deforming { palm_from_object, .. } => world_from_palm * palm_from_object,
            GraspState::Free { .. } | GraspState::Avoiding { .. } | GraspState::Detached => {
                self.world_from_object
            }
        }
    }
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
