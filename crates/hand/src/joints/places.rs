//! Where the joints of the kinematic hand are, as a record would have them.

use nalgebra::{Isometry3, Point3, Vector3};
use softgrasp_grasp::hand::{Finger, HandDimensions, HandPose, Handedness, JointAngles, pose};

use super::record::{JOINT_COUNT, JointSample, JointsRecord, PALM, WRIST, digit_joints};

/// How far the wrist joint lies behind the wrist crease, as a share of the hand length: 20 mm of
/// 180 mm (GraspDB14 skeleton), 19 mm of 172 mm (Immersive Web emulator's default hand).
const WRIST_SHARE: f64 = 0.11;
/// How far the lower end of a finger's metacarpal lies on the way from wrist joint to knuckle
/// (Immersive Web emulator's default hand).
const METACARPAL_SHARE: f64 = 0.37;

/// The wrist joint in the palm frame, m; the same for both hands.
pub fn wrist_in_palm(dimensions: &HandDimensions) -> Point3<f64> {
    Point3::new(0.0, -WRIST_SHARE * dimensions.hand_length, 0.0)
}

/// A right hand's point as it is, a left hand's as its mirror image across the Y–Z plane.
///
/// Units: m. Frame: palm. It is its own inverse.
pub(super) fn mirrored(handedness: Handedness, point: Point3<f64>) -> Point3<f64> {
    match handedness {
        Handedness::Right => point,
        Handedness::Left => Point3::new(-point.x, point.y, point.z),
    }
}

/// Places of the joints of a posed hand: knuckle, two joints and tip of every digit.
///
/// Units: m. Frame: world. Shapes: thumb to little finger, each from the palm to the tip.
pub(super) fn digit_places(pose: &HandPose) -> [[Point3<f64>; 4]; 5] {
    pose.fingers.map(|finger| {
        let [first, second, third] = finger.segments.map(|segment| segment.start());
        [first, second, third, finger.tip()]
    })
}

/// The record that a perfect tracker would send of this hand.
///
/// Units: m, rad. Frame: world. Wrist and digits are joints of the kinematic hand. It has no lower
/// metacarpal ends and no palm joint: those stand at usual places between wrist and knuckles.
pub fn record_of_hand(
    dimensions: &HandDimensions,
    angles: &JointAngles,
    world_from_palm: &Isometry3<f64>,
) -> JointsRecord {
    let posed = pose(dimensions, angles, *world_from_palm);
    let wrist = world_from_palm * wrist_in_palm(dimensions);
    let mut places = [wrist; JOINT_COUNT];
    for finger in Finger::ALL {
        let joints = digit_joints(finger);
        for (joint, place) in joints.into_iter().zip(digit_places(&posed)[finger.index()]) {
            places[joint] = place;
        }
        if finger != Finger::Thumb {
            let knuckle: Vector3<f64> = places[joints[0]] - wrist;
            places[joints[0] - 1] = wrist + knuckle * METACARPAL_SHARE;
        }
    }
    let [knuckle, ..] = digit_joints(Finger::Middle);
    places[PALM] = nalgebra::center(&places[knuckle - 1], &places[knuckle]);
    places[WRIST] = wrist;
    let mut record = JointsRecord::empty(dimensions.handedness);
    record.joints = places.map(|place| Some(JointSample::at(place)));
    record
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_flat_hand_has_its_joints_in_order_along_the_fingers() {
        for side in [Handedness::Right, Handedness::Left] {
            let hand = HandDimensions::default().with_handedness(side);
            let record = record_of_hand(&hand, &JointAngles::flat(), &Isometry3::identity());
            let y = |joint: usize| record.position(joint).unwrap().y;
            for first in [6, 11, 16, 21] {
                for joint in first..first + 4 {
                    assert!(y(WRIST) < y(joint) && y(joint) < y(joint + 1), "joint {joint}");
                }
            }
            assert!(y(11) < y(PALM) && y(PALM) < y(12));
            let index_side = record.position(7).unwrap().x - record.position(22).unwrap().x;
            assert_eq!(index_side > 0.0, side == Handedness::Left, "the thumb's side");
        }
    }
}
