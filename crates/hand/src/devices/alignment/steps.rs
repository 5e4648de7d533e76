//! The two steps of an alignment: the receiver's place on the arm, the transmitter's in the world.

use nalgebra::{Isometry3, Matrix3, Point3, Rotation3, UnitQuaternion, Vector3};
use softgrasp_grasp::hand::{Handedness, JointAngles, forearm_from_palm};

use super::error::AlignmentError;
use crate::devices::mount::ReceiverMount;

/// A hand that is held flat: palm down, fingers forward, the wrist crease at a known place.
#[derive(Clone, Copy, Debug)]
pub struct FlatHand<'a> {
    /// Averaged record of the receiver, in the transmitter's Y-up frame.
    pub stand_from_receiver: Isometry3<f64>,
    /// What the glove read meanwhile; only the wrist counts, for a receiver on the forearm.
    pub angles: &'a JointAngles,
    /// Right or left hand.
    pub hand: Handedness,
}

/// The part of the arm that carries the receiver.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MountPart {
    /// The back of the hand.
    Hand,
    /// The forearm, behind the wrist.
    Forearm,
}

impl MountPart {
    /// The part of the arm on which a receiver with this mount sits.
    pub const fn of(mount: &ReceiverMount) -> Self {
        match mount {
            ReceiverMount::Hand { .. } => Self::Hand,
            ReceiverMount::Forearm { .. } => Self::Forearm,
        }
    }
}

/// What is known about how the transmitter stands.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StandTilt {
    /// It stands level: only its direction is taken from the hand, so that a hand held a little
    /// askew does not tilt the world.
    Level,
    /// It may be mounted in any attitude: all of its rotation is taken from the hand.
    Free,
}

/// Pose of the transmitter in the world, as the alignment found it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StandAlignment {
    /// Transmitter's Y-up frame in the world, m.
    pub world_from_stand: Isometry3<f64>,
    /// How far the back of the hand was from pointing straight up in the transmitter's frame, rad:
    /// for a level transmitter the error of the hand, for others their tilt.
    pub tilt_rad: f64,
}

/// The palm frame of a flat hand in the world: X right, Y forward, Z up.
pub fn flat_hand_at(crease_in_world: Point3<f64>) -> Isometry3<f64> {
    let columns = Matrix3::new(1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, -1.0, 0.0);
    let rotation = Rotation3::from_matrix_unchecked(columns);
    Isometry3::from_parts(crease_in_world.coords.into(), UnitQuaternion::from(rotation))
}

/// First step: where the receiver sits.
///
/// `crease_in_receiver` is the fixed point of a pivot calibration; palm and forearm frames have
/// their origin there. The directions follow from the flat hand and the rotation of
/// `world_from_stand`, which must be right; its translation does not matter.
pub fn aligned_mount(
    flat: &FlatHand<'_>,
    part: MountPart,
    world_from_stand: &Isometry3<f64>,
    crease_in_receiver: Point3<f64>,
) -> ReceiverMount {
    let world_from_receiver = world_from_stand.rotation * flat.stand_from_receiver.rotation;
    let world_from_palm = flat_hand_at(Point3::origin()).rotation;
    let receiver_from_palm = world_from_receiver.inverse() * world_from_palm;
    let at_crease = |rotation| Isometry3::from_parts(crease_in_receiver.coords.into(), rotation);
    match part {
        MountPart::Hand => {
            ReceiverMount::Hand { receiver_from_palm: at_crease(receiver_from_palm) }
        }
        MountPart::Forearm => {
            let palm_from_forearm = forearm_from_palm(flat.angles, flat.hand).rotation.inverse();
            let rotation = receiver_from_palm * palm_from_forearm;
            ReceiverMount::Forearm { receiver_from_forearm: at_crease(rotation) }
        }
    }
}

/// Second step: where the transmitter stands, from a flat hand whose crease is at a known place.
///
/// # Errors
/// [`AlignmentError::FingersUpright`] for a level transmitter if the fingers rise or fall by more
/// than 60° and so show no direction.
pub fn aligned_stand(
    flat: &FlatHand<'_>,
    mount: &ReceiverMount,
    crease_in_world: Point3<f64>,
    tilt: StandTilt,
) -> Result<StandAlignment, AlignmentError> {
    let stand_from_palm = mount.world_from_palm(&flat.stand_from_receiver, flat.angles, flat.hand);
    let world_from_palm = flat_hand_at(crease_in_world);
    let rotation = match tilt {
        StandTilt::Free => world_from_palm.rotation * stand_from_palm.rotation.inverse(),
        StandTilt::Level => {
            let fingers = stand_from_palm * Vector3::y();
            let tilt_rad = fingers.y.clamp(-1.0, 1.0).asin();
            if tilt_rad.abs() > 60f64.to_radians() {
                return Err(AlignmentError::FingersUpright { tilt_rad });
            }
            // Turns the fingers' horizontal direction to forward, which is −Z.
            let heading = fingers.x.atan2(-fingers.z);
            UnitQuaternion::from_axis_angle(&Vector3::y_axis(), heading)
        }
    };
    let crease = rotation * stand_from_palm.translation.vector;
    let shift = crease_in_world.coords - crease;
    let back = stand_from_palm * Vector3::z();
    Ok(StandAlignment {
        world_from_stand: Isometry3::from_parts(shift.into(), rotation),
        tilt_rad: back.y.clamp(-1.0, 1.0).acos(),
    })
}

#[cfg(test)]
mod tests {
    use super::super::synthetic::{Noise, turning_about};
    use super::super::{average_pose, find_pivot};
    use super::*;
    use proptest::prelude::*;

    fn bent_wrist() -> JointAngles {
        JointAngles { wrist_pitch: 0.1, wrist_yaw: -0.15, ..JointAngles::flat() }
    }

    fn mounts(receiver_from_part: Isometry3<f64>) -> [ReceiverMount; 2] {
        [
            ReceiverMount::Hand { receiver_from_palm: receiver_from_part },
            ReceiverMount::Forearm { receiver_from_forearm: receiver_from_part },
        ]
    }

    fn any_pose(shift: f64, turn: f64) -> impl Strategy<Value = Isometry3<f64>> {
        (prop::array::uniform3(-1.0..1.0f64), prop::array::uniform3(-1.0..1.0f64)).prop_map(
            move |(place, axis)| {
                Isometry3::new(Vector3::from(place) * shift, Vector3::from(axis) * turn)
            },
        )
    }

    /// What the tracker reads of a flat hand.
    fn record(
        mount: &ReceiverMount,
        world_from_stand: &Isometry3<f64>,
        crease: Point3<f64>,
        hand: Handedness,
    ) -> Isometry3<f64> {
        let world_from_receiver =
            mount.world_from_receiver(&flat_hand_at(crease), &bent_wrist(), hand);
        world_from_stand.inverse() * world_from_receiver
    }

    #[test]
    fn flat_hand_points_forward_with_its_back_up() {
        let palm = flat_hand_at(Point3::new(0.1, 0.2, 0.3));
        assert!((palm * Vector3::y() + Vector3::z()).norm() < 1e-12);
        assert!((palm * Vector3::z() - Vector3::y()).norm() < 1e-12);
        assert!((palm * Vector3::x() - Vector3::x()).norm() < 1e-12);
    }

    proptest! {
        #[test]
        fn exact_records_give_back_stand_and_mount(
            receiver_from_part in any_pose(0.05, 1.5),
            world_from_stand in any_pose(0.8, 1.5),
            crease in prop::array::uniform3(-0.3..0.3f64),
            on_hand in any::<bool>(), left in any::<bool>(),
        ) {
            let mount = mounts(receiver_from_part)[usize::from(!on_hand)];
            let hand = if left { Handedness::Left } else { Handedness::Right };
            let crease = Point3::from(crease);
            let angles = bent_wrist();
            let stand_from_receiver = record(&mount, &world_from_stand, crease, hand);
            let flat = FlatHand { stand_from_receiver, angles: &angles, hand };
            let found = aligned_mount(
                &flat, MountPart::of(&mount), &world_from_stand,
                receiver_from_part.translation.vector.into(),
            );
            let difference = |a: &Isometry3<f64>, b: &Isometry3<f64>| {
                let way = (a.translation.vector - b.translation.vector).norm();
                way.max(a.rotation.angle_to(&b.rotation))
            };
            let pose = |mount: &ReceiverMount| match mount {
                ReceiverMount::Hand { receiver_from_palm } => *receiver_from_palm,
                ReceiverMount::Forearm { receiver_from_forearm } => *receiver_from_forearm,
            };
            prop_assert!(difference(&pose(&found), &pose(&mount)) < 1e-6);
            let stand = aligned_stand(&flat, &mount, crease, StandTilt::Free).unwrap();
            prop_assert!(difference(&stand.world_from_stand, &world_from_stand) < 1e-6);
        }

        #[test]
        fn a_level_stand_is_found_from_a_hand_held_askew(
            heading in -3.0..3.0f64, askew in -0.2..0.2f64,
            shift in prop::array::uniform3(-0.8..0.8f64),
        ) {
            let world_from_stand =
                Isometry3::new(Vector3::from(shift), Vector3::y() * heading);
            let mount = ReceiverMount::default();
            let crease = Point3::new(0.1, 0.0, 0.2);
            // The hand is rolled about its fingers: its heading and its crease stay.
            let roll = UnitQuaternion::from_axis_angle(&Vector3::y_axis(), askew);
            let palm = flat_hand_at(crease) * roll;
            let angles = JointAngles::flat();
            let world_from_receiver = mount.world_from_receiver(&palm, &angles, Handedness::Right);
            let flat = FlatHand {
                stand_from_receiver: world_from_stand.inverse() * world_from_receiver,
                angles: &angles,
                hand: Handedness::Right,
            };
            let stand = aligned_stand(&flat, &mount, crease, StandTilt::Level).unwrap();
            let off = stand.world_from_stand.rotation.angle_to(&world_from_stand.rotation);
            prop_assert!(off < 1e-6, "{off}");
            let found = stand.world_from_stand.translation.vector;
            prop_assert!((found - world_from_stand.translation.vector).norm() < 1e-9);
            prop_assert!((stand.tilt_rad - askew.abs()).abs() < 1e-6);
        }

        #[test]
        fn both_steps_through_the_noise_of_a_tracker(seed in any::<u64>()) {
            let mut noise = Noise::new(seed);
            let truth = ReceiverMount::default();
            let ReceiverMount::Forearm { receiver_from_forearm } = truth else { unreachable!() };
            let crease_in_receiver = Point3::from(receiver_from_forearm.translation.vector);
            let world_from_stand = Isometry3::new(Vector3::new(0.1, -0.3, 0.6), Vector3::y() * 0.4);
            let crease = Point3::origin();
            let angles = bent_wrist();
            let hand = Handedness::Right;
            let still = record(&truth, &world_from_stand, crease, hand);
            let records: Vec<_> = (0..120).map(|_| noise.around(&still)).collect();
            let place = Point3::new(0.2, -0.1, -0.5);
            let turning = turning_about(crease_in_receiver, place, 240, 0.35, &mut noise);
            let pivot = find_pivot(&turning).unwrap();
            let flat = FlatHand {
                stand_from_receiver: average_pose(&records).unwrap().pose,
                angles: &angles,
                hand,
            };
            // The stand's rotation is known for the first step, all of it is found in the second.
            let mount =
                aligned_mount(&flat, MountPart::Forearm, &world_from_stand, pivot.in_receiver);
            let stand = aligned_stand(&flat, &mount, crease, StandTilt::Free).unwrap();
            // What counts: where another pose of the hand is then seen.
            let palm = Isometry3::new(Vector3::new(0.15, 0.1, -0.2), Vector3::new(0.5, 1.0, -0.3));
            let in_world = truth.world_from_receiver(&palm, &angles, hand);
            let reading = world_from_stand.inverse() * in_world;
            let seen = mount.world_from_palm(&(stand.world_from_stand * reading), &angles, hand);
            let way = (seen.translation.vector - palm.translation.vector).norm();
            prop_assert!(way < 2.5e-3, "{way}");
            prop_assert!(seen.rotation.angle_to(&palm.rotation).to_degrees() < 0.15);
        }
    }

    #[test]
    fn upright_fingers_show_no_direction() {
        let angles = JointAngles::flat();
        let stand_from_receiver = Isometry3::new(Vector3::zeros(), Vector3::new(0.0, -1.5, 0.0));
        let flat = FlatHand { stand_from_receiver, angles: &angles, hand: Handedness::Right };
        let upright = |turn: Vector3<f64>| {
            let palm = flat_hand_at(Point3::origin()) * UnitQuaternion::from_scaled_axis(turn);
            let mount = ReceiverMount::default();
            let receiver = mount.world_from_receiver(&palm, &angles, Handedness::Right);
            let flat = FlatHand { stand_from_receiver: receiver, ..flat };
            aligned_stand(&flat, &mount, Point3::origin(), StandTilt::Level)
        };
        assert!(upright(Vector3::x() * 0.5).is_ok());
        let error = upright(Vector3::x() * 1.3).unwrap_err();
        assert!(matches!(error, AlignmentError::FingersUpright { .. }), "{error}");
    }
}
