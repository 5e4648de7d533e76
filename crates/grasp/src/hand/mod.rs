//! The hand: joints, dimensions, kinematics and the colliders made from them.

mod colliders;
mod dimensions;
mod jacobian;
mod joints;
mod kinematics;
mod rigid_bodies;

pub use colliders::{FingerColliders, HandColliders};
pub use dimensions::{
    DimensionsError, FingerDimensions, HandDimensions, Handedness, ThumbDimensions,
};
pub use jacobian::contact_jacobian;
pub use joints::{ANGLE_COUNT, ANGLE_NAMES, Finger, FingerAngles, JointAngles, ThumbAngles};
pub use kinematics::{
    FingerPose, HandPose, SegmentPose, forearm_from_palm, pose, pose_of_segments,
};
pub use rigid_bodies::{HAND_BODIES, HandBody, above_table, clearance, hand_bodies};
