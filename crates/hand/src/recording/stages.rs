//! Digests of what the stages of a tick made, so that two runs can be compared stage by stage.

use std::fmt;

use serde::{Deserialize, Serialize};

/// Stages of a tick, in the order in which each depends on those before it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stage {
    /// Pose of the hand, from the bytes of its devices.
    Pose,
    /// State of the grasp, what each fingertip holds, place of the object, segments as shown.
    Contacts,
    /// Known displacements and the partition, as the server is asked.
    Request,
    /// Displacement of every node as it is shown.
    Displacement,
}

impl fmt::Display for Stage {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Pose => "pose",
            Self::Contacts => "contacts",
            Self::Request => "request",
            Self::Displacement => "displacement",
        })
    }
}

/// 128 bits of a BLAKE3 hash over the exact bits of numbers; empty where the stage made nothing.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct StageDigests {
    /// Digest of [`Stage::Pose`].
    pub pose: String,
    /// Digest of [`Stage::Contacts`].
    pub contacts: String,
    /// Digest of [`Stage::Request`].
    pub request: String,
    /// Digest of [`Stage::Displacement`].
    pub displacement: String,
}

impl StageDigests {
    /// The first stage in which two ticks differ.
    pub fn first_difference(&self, other: &Self) -> Option<Stage> {
        let stages = [
            (Stage::Pose, self.pose == other.pose),
            (Stage::Contacts, self.contacts == other.contacts),
            (Stage::Request, self.request == other.request),
            (Stage::Displacement, self.displacement == other.displacement),
        ];
        stages.into_iter().find(|(_, same)| !same).map(|(stage, _)| stage)
    }
}
