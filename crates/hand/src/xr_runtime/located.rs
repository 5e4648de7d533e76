//! Joints as a runtime locates them, and the record that they make.

use nalgebra::{Point3, Quaternion, UnitQuaternion};
use softgrasp_grasp::hand::Handedness;

use crate::joints::{JOINT_COUNT, JointSample, JointsRecord, RANGE_M};

/// Bit of `XrSpaceLocationFlags`: the orientation means something.
pub const ORIENTATION_VALID: u64 = 1;
/// Bit of `XrSpaceLocationFlags`: the position means something.
pub const POSITION_VALID: u64 = 1 << 1;
/// Bit of `XrSpaceLocationFlags`: the position is tracked now, and not guessed from what was or from the
/// other joints.
pub const POSITION_TRACKED: u64 = 1 << 3;

/// Largest radius of a joint that is believed, m.
const RADIUS_MAX_M: f64 = 1.0;
/// Difference of a quaternion's length from 1 that rounding to single precision and a careless sender may
/// make.
const LENGTH_TOLERANCE: f64 = 0.01;

/// A joint as a runtime locates it (`XrHandJointLocationEXT`).
///
/// Units: m. Frame: the reference space, which is right-handed with Y up, as the world's (`docs/frames.md`).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct LocatedJoint {
    /// Bits of `XrSpaceLocationFlags`.
    pub flags: u64,
    /// Position: x, y, z.
    pub position: [f64; 3],
    /// Orientation: x, y, z, w of a unit quaternion.
    pub orientation: [f64; 4],
    /// Distance from the joint to the skin.
    pub radius_m: f64,
}

impl LocatedJoint {
    /// The joint of a record; `None` where its place is not known, is no number, or lies further away than a
    /// room is wide. An orientation and a radius that cannot be are left out.
    fn sample(&self) -> Option<JointSample> {
        // Also false for what is not a number.
        let is_near = self.position.iter().all(|c| c.abs() <= RANGE_M);
        if self.flags & POSITION_VALID == 0 || !is_near {
            return None;
        }
        let [x, y, z, w] = self.orientation;
        let quaternion = Quaternion::new(w, x, y, z);
        let is_turn = self.flags & ORIENTATION_VALID != 0
            && (quaternion.norm() - 1.0).abs() <= LENGTH_TOLERANCE;
        let is_radius = (0.0..=RADIUS_MAX_M).contains(&self.radius_m);
        Some(JointSample {
            orientation: is_turn.then(|| UnitQuaternion::new_normalize(quaternion)),
            radius_m: is_radius.then_some(self.radius_m),
            ..JointSample::at(Point3::from(self.position))
        })
    }
}

/// The record of a hand from its joints in the order of OpenXR; `None` if not one of them is tracked: then
/// the hand is out of sight, and what the runtime says is where it was.
///
/// A joint that is guessed beside others that are tracked (a finger behind the palm) is taken: the runtime
/// knows no less about it than anybody behind it would.
///
/// Units: m, `time_s` s on the runtime's clock. Frame: as [`LocatedJoint`].
pub fn record_of(
    hand: Handedness,
    joints: &[LocatedJoint; JOINT_COUNT],
    frame: u64,
    time_s: f64,
) -> Option<JointsRecord> {
    let samples = joints.map(|joint| joint.sample());
    let is_tracked = |(joint, sample): (&LocatedJoint, &Option<JointSample>)| {
        sample.is_some() && joint.flags & POSITION_TRACKED != 0
    };
    let is_seen = joints.iter().zip(&samples).any(is_tracked);
    is_seen.then(|| JointsRecord {
        frame: Some(frame),
        time_s: time_s.is_finite().then_some(time_s),
        joints: samples,
        ..JointsRecord::empty(hand)
    })
}

#[cfg(test)]
mod tests {
    use nalgebra::{Isometry3, Vector3};
    use softgrasp_grasp::hand::{HandDimensions, JointAngles};

    use super::*;
    use crate::joints::{HandFit, record_of_hand};

    const ALL: u64 = ORIENTATION_VALID | POSITION_VALID | (1 << 2) | POSITION_TRACKED;

    fn joint(flags: u64, x: f64) -> LocatedJoint {
        let orientation = [0.0, 0.6, 0.0, 0.8];
        LocatedJoint { flags, position: [x, 1.2, -0.4], orientation, radius_m: 0.01 }
    }

    #[test]
    fn located_hand_is_the_record_that_fits_it() {
        for side in [Handedness::Left, Handedness::Right] {
            let hand = HandDimensions::default().with_handedness(side);
            let palm = Isometry3::new(Vector3::new(0.1, 1.2, -0.4), Vector3::new(0.3, -0.2, 0.5));
            let seen = record_of_hand(&hand, &JointAngles::fist(), &palm);
            let located = seen.joints.map(|sample| LocatedJoint {
                flags: ALL,
                position: sample.unwrap().position.into(),
                orientation: [0.0, 0.0, 0.0, 1.0],
                radius_m: 0.01,
            });
            let record = record_of(side, &located, 7, 0.5).unwrap();
            assert_eq!((record.hand, record.frame, record.time_s), (side, Some(7), Some(0.5)));
            let fitted = HandFit::new(hand).fit(&record).unwrap();
            assert!(fitted.fit_error_max_m < 1e-6, "{}", fitted.fit_error_max_m);
            let off = fitted.world_from_palm.translation.vector - palm.translation.vector;
            assert!(off.norm() < 1e-6, "nothing is turned or mirrored: {off}");
        }
    }

    #[test]
    fn flags_say_what_of_a_joint_is_known() {
        let mut joints = [joint(ALL, 0.1); JOINT_COUNT];
        joints[3] = joint(ORIENTATION_VALID, 0.2);
        joints[4] = joint(POSITION_VALID, 0.3);
        joints[5] = joint(POSITION_VALID | ORIENTATION_VALID, 0.4);
        let record = record_of(Handedness::Right, &joints, 0, 0.0).unwrap();
        assert_eq!(record.joints[3], None, "its place is not known");
        let without = record.joints[4].unwrap();
        assert_eq!((without.position.x, without.orientation), (0.3, None));
        let guessed = record.joints[5].unwrap();
        assert_eq!((guessed.position.x, guessed.radius_m), (0.4, Some(0.01)));
        let turn = guessed.orientation.unwrap();
        assert!((turn.j - 0.6).abs() < 1e-12 && (turn.w - 0.8).abs() < 1e-12, "{turn}");
    }

    #[test]
    fn hand_of_which_nothing_is_tracked_is_out_of_sight() {
        let guessed = [joint(ALL & !POSITION_TRACKED, 0.1); JOINT_COUNT];
        assert_eq!(record_of(Handedness::Left, &guessed, 0, 0.0), None);
        let mut one = guessed;
        one[9] = joint(ALL, 0.1);
        assert!(record_of(Handedness::Left, &one, 0, 0.0).is_some());
        // What is tracked and nowhere is not seen.
        one[9] = joint(ALL, f64::NAN);
        assert_eq!(record_of(Handedness::Left, &one, 0, 0.0), None);
    }

    #[test]
    fn numbers_that_no_joint_has_are_left_out() {
        let mut joints = [joint(ALL, 0.1); JOINT_COUNT];
        joints[0] = joint(ALL, f64::INFINITY);
        joints[1] = joint(ALL, 2.0 * RANGE_M);
        joints[2] = LocatedJoint { orientation: [0.0; 4], ..joint(ALL, 0.1) };
        joints[3] = LocatedJoint { orientation: [f64::NAN; 4], ..joint(ALL, 0.1) };
        joints[4] = LocatedJoint { radius_m: f64::NAN, ..joint(ALL, 0.1) };
        joints[5] = LocatedJoint { radius_m: -0.01, ..joint(ALL, 0.1) };
        let record = record_of(Handedness::Right, &joints, 0, f64::NAN).unwrap();
        assert_eq!((record.joints[0], record.joints[1], record.time_s), (None, None, None));
        let turns = [2, 3].map(|at| record.joints[at].unwrap().orientation);
        assert_eq!(turns, [None, None]);
        assert_eq!([4, 5].map(|at| record.joints[at].unwrap().radius_m), [None, None]);
    }
}
