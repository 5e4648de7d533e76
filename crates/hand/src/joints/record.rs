//! One record of tracked hand joints: what it holds and its line of JSON.

use std::fmt::Write;

use nalgebra::{Point3, UnitQuaternion};
use softgrasp_grasp::hand::{Finger, Handedness};

/// Joints of a record, in the order of OpenXR (`XR_EXT_hand_tracking`).
pub const JOINT_COUNT: usize = 26;

/// Joints of a hand in WebXR: those of OpenXR without the palm, each number one less.
pub const WEBXR_JOINT_COUNT: usize = 25;

/// Number of the palm joint in a record.
pub const PALM: usize = 0;

/// Number of the wrist joint in a record.
pub const WRIST: usize = 1;

/// Names of the joints as WebXR has them; the palm, which WebXR lacks, is called `palm`.
pub const JOINT_NAMES: [&str; JOINT_COUNT] = [
    "palm",
    "wrist",
    "thumb-metacarpal",
    "thumb-phalanx-proximal",
    "thumb-phalanx-distal",
    "thumb-tip",
    "index-finger-metacarpal",
    "index-finger-phalanx-proximal",
    "index-finger-phalanx-intermediate",
    "index-finger-phalanx-distal",
    "index-finger-tip",
    "middle-finger-metacarpal",
    "middle-finger-phalanx-proximal",
    "middle-finger-phalanx-intermediate",
    "middle-finger-phalanx-distal",
    "middle-finger-tip",
    "ring-finger-metacarpal",
    "ring-finger-phalanx-proximal",
    "ring-finger-phalanx-intermediate",
    "ring-finger-phalanx-distal",
    "ring-finger-tip",
    "pinky-finger-metacarpal",
    "pinky-finger-phalanx-proximal",
    "pinky-finger-phalanx-intermediate",
    "pinky-finger-phalanx-distal",
    "pinky-finger-tip",
];

/// Numbers of a digit's four joints that the kinematic hand has too: knuckle, two joints, tip.
///
/// The thumb's are metacarpal (the trapeziometacarpal joint), proximal, distal, tip; a finger's
/// proximal (the metacarpophalangeal joint), intermediate, distal, tip.
pub const fn digit_joints(finger: Finger) -> [usize; 4] {
    let first = match finger {
        Finger::Thumb => 2,
        _ => 5 * finger.index() + 2,
    };
    [first, first + 1, first + 2, first + 3]
}

/// One tracked joint.
///
/// Units: m. Frame: world (`docs/frames.md`). The joint's own axes are those of OpenXR: −Z toward
/// the fingertip, +Y out of the back of the hand.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct JointSample {
    /// Position of the joint.
    pub position: Point3<f64>,
    /// Orientation of the joint, where the sender gives one.
    pub orientation: Option<UnitQuaternion<f64>>,
    /// Distance from the joint to the skin, where the sender gives it.
    pub radius_m: Option<f64>,
}

impl JointSample {
    /// A joint of which only the place is known.
    pub const fn at(position: Point3<f64>) -> Self {
        Self { position, orientation: None, radius_m: None }
    }
}

/// All joints of one hand at one moment.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct JointsRecord {
    /// Right or left hand.
    pub hand: Handedness,
    /// Time by the sender's clock, s.
    pub time_s: Option<f64>,
    /// Number that the sender gave the record.
    pub frame: Option<u64>,
    /// Joints in the order of [`JOINT_NAMES`]; `None` is a joint that was not tracked.
    pub joints: [Option<JointSample>; JOINT_COUNT],
}

impl JointsRecord {
    /// A record without any joint.
    pub const fn empty(hand: Handedness) -> Self {
        Self { hand, time_s: None, frame: None, joints: [None; JOINT_COUNT] }
    }

    /// Position of a joint, if it was tracked.
    pub fn position(&self, joint: usize) -> Option<Point3<f64>> {
        self.joints.get(joint).copied().flatten().map(|sample| sample.position)
    }

    /// The record as a line of JSON with all 26 joints, LF included.
    ///
    /// Positions come back as they are, orientations up to rounding.
    pub fn to_line(&self) -> String {
        self.line_of(&self.joints)
    }

    /// The record as a line of JSON with the 25 joints of WebXR, LF included.
    pub fn to_webxr_line(&self) -> String {
        self.line_of(&self.joints[WRIST..])
    }

    fn line_of(&self, joints: &[Option<JointSample>]) -> String {
        let hand = self.hand.name();
        let mut line = format!("{{\"hand\":\"{hand}\"");
        if let Some(time_s) = self.time_s {
            let _ = write!(line, ",\"time\":{time_s}");
        }
        if let Some(frame) = self.frame {
            let _ = write!(line, ",\"frame\":{frame}");
        }
        let entries: Vec<String> = joints.iter().map(|joint| entry_text(joint.as_ref())).collect();
        let _ = writeln!(line, ",\"joints\":[{}]}}", entries.join(","));
        line
    }
}

fn entry_text(joint: Option<&JointSample>) -> String {
    let Some(joint) = joint else { return "null".to_owned() };
    let numbers = |values: &[f64]| {
        let texts: Vec<String> = values.iter().map(f64::to_string).collect();
        format!("[{}]", texts.join(","))
    };
    let position: [f64; 3] = joint.position.into();
    let orientation = joint.orientation.map(|q| [q.i, q.j, q.k, q.w]);
    match (joint.radius_m, orientation) {
        (None, None) => numbers(&position),
        (None, Some(q)) => numbers(&[&position[..], &q].concat()),
        (Some(radius), _) => {
            let turn = orientation.map(|q| format!(",\"orientation\":{}", numbers(&q)));
            let (position, turn) = (numbers(&position), turn.unwrap_or_default());
            format!("{{\"position\":{position}{turn},\"radius\":{radius}}}")
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn digits_have_the_numbers_of_their_names() {
        let words = ["thumb", "index", "middle", "ring", "pinky"];
        for (finger, word) in Finger::ALL.into_iter().zip(words) {
            let bones = match finger {
                Finger::Thumb => ["metacarpal", "phalanx-proximal", "phalanx-distal", "tip"],
                _ => ["phalanx-proximal", "phalanx-intermediate", "phalanx-distal", "tip"],
            };
            for (joint, bone) in digit_joints(finger).into_iter().zip(bones) {
                let name = JOINT_NAMES[joint];
                assert!(name.starts_with(word) && name.ends_with(bone), "{name} is no {bone}");
            }
        }
    }

    #[test]
    fn a_line_has_the_shortest_form_that_holds_what_is_known() {
        let mut record = JointsRecord::empty(Handedness::Left);
        record.frame = Some(7);
        record.joints[PALM] = Some(JointSample::at(Point3::new(0.25, 1.0, -0.5)));
        let turned = JointSample {
            orientation: Some(UnitQuaternion::identity()),
            ..JointSample::at(Point3::origin())
        };
        record.joints[WRIST] = Some(turned);
        record.joints[2] = Some(JointSample { radius_m: Some(0.02), ..turned });
        let line = record.to_line();
        let start = "{\"hand\":\"left\",\"frame\":7,\"joints\":[[0.25,1,-0.5],[0,0,0,0,0,0,1],\
                     {\"position\":[0,0,0],\"orientation\":[0,0,0,1],\"radius\":0.02},null";
        assert!(line.starts_with(start), "{line}");
        assert!(line.ends_with("null]}\n"));
        assert!(record.to_webxr_line().contains("\"joints\":[[0,0,0,0,0,0,1],"));
    }
}
