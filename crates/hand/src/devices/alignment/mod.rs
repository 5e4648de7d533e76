//! Finds where the receiver sits on the arm and where the transmitter stands in the world.
//!
//! Two steps. The receiver first: the hand turns about its resting wrist crease, which gives the
//! crease in the receiver's frame ([`find_pivot`]), and is held flat, which gives the receiver's
//! directions ([`aligned_mount`]). Then the transmitter: the flat hand at a known place of the
//! world gives the way from the transmitter to the world ([`aligned_stand`]).
//!
//! A flat hand alone determines only both rotations together: the first step takes that of the
//! transmitter as given, the second that of the receiver.

mod average;
mod error;
mod pivot;
mod steps;
#[cfg(test)]
mod synthetic;

pub use average::{AveragedPose, average_pose};
pub use error::AlignmentError;
pub use pivot::{Pivot, find_pivot};
pub use steps::{
    FlatHand, MountPart, StandAlignment, StandTilt, aligned_mount, aligned_stand, flat_hand_at,
};
