//! Pictures of a Leap recording as records of joints.

use softgrasp_grasp::hand::Finger;

use super::record::{JointSample, JointsRecord, digit_joints};
use crate::devices::recordings::LeapFrame;

impl From<&LeapFrame> for JointsRecord {
    /// The 20 joints of a picture; wrist, palm and lower metacarpal ends are not tracked.
    ///
    /// The camera's frame (X right, Y up, Z toward the user) is taken as the world.
    fn from(frame: &LeapFrame) -> Self {
        let mut record = Self::empty(frame.hand);
        record.time_s = Some(frame.time_s);
        for finger in Finger::ALL {
            for (joint, place) in digit_joints(finger).into_iter().zip(frame.joints[finger.index()])
            {
                record.joints[joint] = Some(JointSample::at(place));
            }
        }
        record
    }
}
