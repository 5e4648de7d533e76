//! Joints of a hand from other trackers (OpenXR, WebXR, Leap), and the kinematic hand that fits them.

mod bones;
mod cut;
mod decode;
mod doubts;
mod fault;
mod feed;
mod fit;
mod leap;
mod least_squares;
mod limits;
mod listener;
mod normal;
mod parser;
mod personal;
mod places;
mod queue;
#[cfg(test)]
mod real_hands_tests;
mod record;
mod rigid;
mod sender;
#[cfg(test)]
mod sender_tests;
mod slope;
mod start;

pub use bones::{HandSize, SizeError, hand_size};
pub use cut::LINE_MAX;
pub use doubts::Doubts;
pub use fault::{JointsFault, JointsFaultKind, RANGE_M};
pub use feed::JointsFeed;
pub use fit::{FitError, FittedHand, HandFit};
pub use limits::AngleLimits;
pub use listener::{DEFAULT_PORT, JointsError, JointsListener};
pub use parser::{JointsEvent, JointsParser};
pub use personal::fitted_dimensions;
pub use places::{record_of_hand, wrist_in_palm};
pub use queue::ArrivedBytes;
pub use record::{
    JOINT_COUNT, JOINT_NAMES, JointSample, JointsRecord, PALM, WEBXR_JOINT_COUNT, WRIST,
    digit_joints,
};
