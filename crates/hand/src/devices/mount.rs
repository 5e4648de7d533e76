//! The place of the tracker's receiver on the arm, and the palm's pose that follows from it.

use nalgebra::{Isometry3, Matrix3, Rotation3, Translation3, UnitQuaternion};
use softgrasp_grasp::hand::{Handedness, JointAngles, forearm_from_palm};

/// Place of the receiver, part of the configuration of a set-up.
///
/// Units: m. Frame: palm and forearm frames have their origin at the wrist crease
/// (`docs/frames.md`).
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ReceiverMount {
    /// On the back of the hand: the wrist sensors are not needed.
    Hand {
        /// Palm frame in the receiver frame.
        receiver_from_palm: Isometry3<f64>,
    },
    /// On the forearm, behind the wrist: the wrist sensors complete the way to the palm.
    Forearm {
        /// Forearm frame in the receiver frame.
        receiver_from_forearm: Isometry3<f64>,
    },
}

impl Default for ReceiverMount {
    /// On the wristband: 40 mm behind the crease, 30 mm above it, cable toward the elbow.
    fn default() -> Self {
        let forearm_from_receiver =
            Isometry3::from_parts(Translation3::new(0.0, -0.04, 0.03), along_the_arm());
        Self::Forearm { receiver_from_forearm: forearm_from_receiver.inverse() }
    }
}

impl ReceiverMount {
    /// Palm frame in the world, from the tracker's reading and the wrist angles.
    pub fn world_from_palm(
        &self,
        world_from_receiver: &Isometry3<f64>,
        angles: &JointAngles,
        hand: Handedness,
    ) -> Isometry3<f64> {
        world_from_receiver * self.receiver_from_palm(angles, hand)
    }

    /// What the tracker would read for a palm at this place: the inverse, for a scripted hand.
    pub fn world_from_receiver(
        &self,
        world_from_palm: &Isometry3<f64>,
        angles: &JointAngles,
        hand: Handedness,
    ) -> Isometry3<f64> {
        world_from_palm * self.receiver_from_palm(angles, hand).inverse()
    }

    fn receiver_from_palm(&self, angles: &JointAngles, hand: Handedness) -> Isometry3<f64> {
        match self {
            Self::Hand { receiver_from_palm } => *receiver_from_palm,
            Self::Forearm { receiver_from_forearm } => {
                receiver_from_forearm * forearm_from_palm(angles, hand)
            }
        }
    }
}

/// Receiver X (forward) along the arm's +Y, Y (right) along +X, Z (down) along −Z.
fn along_the_arm() -> UnitQuaternion<f64> {
    let columns = Matrix3::new(0.0, 1.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, -1.0);
    UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(columns))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::devices::fastrak::{Attitude, FastrakRecord, LengthUnit, Station};
    use nalgebra::{Point3, Vector3};
    use proptest::prelude::*;

    #[test]
    fn level_receiver_means_palm_down_and_fingers_forward() {
        let record = FastrakRecord {
            station: Station::try_new(1).unwrap(),
            error: None,
            position: [50.0, 0.0, 20.0],
            units: LengthUnit::Centimetres,
            attitude: Attitude::EulerDeg { azimuth_deg: 0.0, elevation_deg: 0.0, roll_deg: 0.0 },
        };
        let world_from_receiver = record.world_from_receiver();
        let flat = JointAngles::flat();
        let world_from_palm = ReceiverMount::default().world_from_palm(
            &world_from_receiver,
            &flat,
            Handedness::Right,
        );
        assert!((world_from_palm * Vector3::y() + Vector3::z()).norm() < 1e-12, "fingers forward");
        assert!((world_from_palm * Vector3::z() - Vector3::y()).norm() < 1e-12, "back up");
        // The wrist crease is 40 mm ahead of the receiver and 30 mm below it.
        let wrist = world_from_palm * Point3::origin();
        assert!((wrist - Point3::new(0.0, -0.23, -0.54)).norm() < 1e-12);
    }

    #[test]
    fn bent_wrist_moves_the_palm_of_a_forearm_mount_only() {
        let bent = JointAngles { wrist_pitch: 0.5, ..JointAngles::flat() };
        let at = |mount: ReceiverMount, angles: JointAngles| {
            mount.world_from_palm(&Isometry3::identity(), &angles, Handedness::Left)
        };
        let on_hand = ReceiverMount::Hand { receiver_from_palm: Isometry3::identity() };
        assert_eq!(at(on_hand, bent), at(on_hand, JointAngles::flat()));
        let forearm = ReceiverMount::default();
        let turned =
            at(forearm, bent).rotation.angle_to(&at(forearm, JointAngles::flat()).rotation);
        assert!((turned - 0.5).abs() < 1e-9);
    }

    proptest! {
        #[test]
        fn reading_and_palm_are_inverse(
            values in prop::array::uniform23(-0.5..1.0f64),
            shift in prop::array::uniform3(-1.0..1.0f64),
            turn in prop::array::uniform3(-2.0..2.0f64),
        ) {
            let angles = JointAngles::from_array(&values);
            let palm = Isometry3::new(shift.into(), turn.into());
            let mount = ReceiverMount::default();
            let reading = mount.world_from_receiver(&palm, &angles, Handedness::Left);
            let back = mount.world_from_palm(&reading, &angles, Handedness::Left);
            prop_assert!((back.translation.vector - palm.translation.vector).norm() < 1e-12);
            prop_assert!(back.rotation.angle_to(&palm.rotation) < 1e-7);
        }
    }
}
