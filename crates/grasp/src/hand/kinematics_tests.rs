//! Tests of the hand kinematics: a naive oracle of 4 × 4 matrices, properties, flat-hand figures.

use nalgebra::Matrix4;
use proptest::prelude::*;

use super::*;
use crate::hand::{ANGLE_COUNT, contact_jacobian};

/// Joint angles inside what a hand can do.
fn any_angles() -> impl Strategy<Value = JointAngles> {
    prop::array::uniform23(-0.5..1.6f64).prop_map(|a| JointAngles::from_array(&a))
}

fn any_isometry() -> impl Strategy<Value = Isometry3<f64>> {
    let triple = || prop::array::uniform3(-2.0..2.0f64);
    (triple(), triple()).prop_map(|(shift, turn)| Isometry3::new(shift.into(), turn.into()))
}

fn flat_hand() -> HandPose {
    pose(&HandDimensions::default(), &JointAngles::flat(), Isometry3::identity())
}

fn shift(x: f64, y: f64, z: f64) -> Matrix4<f64> {
    Matrix4::new(1., 0., 0., x, 0., 1., 0., y, 0., 0., 1., z, 0., 0., 0., 1.)
}

fn turn_x(angle: f64) -> Matrix4<f64> {
    let (s, c) = angle.sin_cos();
    Matrix4::new(1., 0., 0., 0., 0., c, -s, 0., 0., s, c, 0., 0., 0., 0., 1.)
}

fn turn_y(angle: f64) -> Matrix4<f64> {
    let (s, c) = angle.sin_cos();
    Matrix4::new(c, 0., s, 0., 0., 1., 0., 0., -s, 0., c, 0., 0., 0., 0., 1.)
}

fn turn_z(angle: f64) -> Matrix4<f64> {
    let (s, c) = angle.sin_cos();
    Matrix4::new(c, -s, 0., 0., s, c, 0., 0., 0., 0., 1., 0., 0., 0., 0., 1.)
}

/// End of a right hand's pulp in the palm frame, as one product of textbook matrices.
fn tip_by_matrices(hand: &HandDimensions, a: &JointAngles, finger: Finger) -> Point3<f64> {
    let lengths = hand.segment_lengths()[finger.index()];
    let chain = match a.finger(finger) {
        Some(f) => {
            let d = &hand.fingers[finger.index() - 1];
            turn_y(d.arch_share * a.palm_arch)
                * shift(d.mcp_in_palm.x, d.mcp_in_palm.y, d.mcp_in_palm.z)
                * turn_z(d.fan + f.abduction)
                * turn_x(-f.mcp_flexion)
                * shift(0., lengths[0], 0.)
                * turn_x(-f.pip_flexion)
                * shift(0., lengths[1], 0.)
                * turn_x(-f.dip_flexion)
        }
        None => {
            let (d, t) = (&hand.thumb, &a.thumb);
            let to_index = hand.fingers[0].mcp_in_palm - d.tmj_in_palm;
            // Yaw the X axis toward the index MPJ, then pitch it up to its height.
            let yaw = to_index.y.atan2(to_index.x);
            let pitch = to_index.z.atan2(to_index.xy().norm());
            shift(d.tmj_in_palm.x, d.tmj_in_palm.y, d.tmj_in_palm.z)
                * turn_z(yaw)
                * turn_y(-pitch)
                * turn_x(-t.rotation)
                * turn_z(d.fan + t.abduction)
                * turn_z(-90f64.to_radians())
                * turn_y(-d.roll)
                * shift(0., lengths[0], 0.)
                * turn_x(-t.mcp_flexion)
                * shift(0., lengths[1], 0.)
                * turn_x(-t.ip_flexion)
        }
    };
    chain.transform_point(&Point3::new(0., lengths[2], 0.))
}

proptest! {
    #[test]
    fn segment_lengths_do_not_change_with_the_angles(
        angles in any_angles(), world_from_palm in any_isometry(), left in any::<bool>(),
    ) {
        let side = if left { Handedness::Left } else { Handedness::Right };
        let hand = HandDimensions::default().with_handedness(side);
        let posed = pose(&hand, &angles, world_from_palm);
        for (finger, lengths) in posed.fingers.iter().zip(hand.segment_lengths()) {
            for (segment, length) in finger.segments.iter().zip(lengths) {
                prop_assert!(((segment.end() - segment.start()).norm() - length).abs() < 1e-12);
            }
            for pair in finger.segments.windows(2) {
                prop_assert!((pair[0].end() - pair[1].start()).norm() < 1e-12);
            }
        }
    }

    #[test]
    fn fingertips_equal_the_product_of_4x4_matrices(
        angles in any_angles(), world_from_palm in any_isometry(),
    ) {
        let hand = HandDimensions::default();
        let posed = pose(&hand, &angles, world_from_palm);
        for finger in Finger::ALL {
            let naive = world_from_palm * tip_by_matrices(&hand, &angles, finger);
            prop_assert!((posed.finger(finger).tip() - naive).norm() < 1e-12);
        }
    }

    #[test]
    fn left_hand_is_the_mirror_image_of_the_right_one(angles in any_angles()) {
        let right = HandDimensions::default();
        let left = right.with_handedness(Handedness::Left);
        let [r, l] = [right, left].map(|hand| pose(&hand, &angles, Isometry3::identity()));
        let mirror = |p: Point3<f64>| Point3::new(-p.x, p.y, p.z);
        for (r, l) in r.fingers.iter().zip(&l.fingers) {
            prop_assert!((mirror(r.tip()) - l.tip()).norm() < 1e-12);
            prop_assert!((mirror(r.contact_point) - l.contact_point).norm() < 1e-12);
            for (r, l) in r.segments.iter().zip(&l.segments) {
                // Bone and back of the finger mirror; the frame stays right-handed.
                let (r, l) = (r.world_from_segment, l.world_from_segment);
                for axis in [Vector3::y(), Vector3::z()] {
                    let mirrored = (r * axis).component_mul(&Vector3::new(-1., 1., 1.));
                    prop_assert!((mirrored - l * axis).norm() < 1e-12);
                }
            }
        }
    }

    #[test]
    fn more_flexion_of_a_straight_finger_moves_its_tip_further_to_the_palm_side(
        digit in 1usize..5, joint in 0usize..3, flexion in 0.01..1.4f64,
    ) {
        let mut angles = [0.0; ANGLE_COUNT];
        angles[4 * digit + joint] = flexion;
        let hand = HandDimensions::default();
        let bent = pose(&hand, &JointAngles::from_array(&angles), Isometry3::identity());
        let drop = flat_hand().fingers[digit].tip().z - bent.fingers[digit].tip().z;
        // The part of the finger beyond the joint hangs down by its length times the sine.
        let beyond: f64 = hand.segment_lengths()[digit][joint..].iter().sum();
        prop_assert!((drop - beyond * flexion.sin()).abs() < 1e-12);
    }
}

#[test]
fn flat_hand_is_as_long_as_its_hand_length() {
    for (length, breadth) in [(0.166, 0.075), (0.185, 0.084), (0.2, 0.09)] {
        let hand = HandDimensions::scaled(length, breadth).unwrap();
        let flat = pose(&hand, &JointAngles::flat(), Isometry3::identity());
        let middle = flat.finger(Finger::Middle).tip();
        assert!((middle - Point3::new(0.0, length, 0.0)).norm() < 1e-12);
    }
}

#[test]
fn flat_fingertips_are_where_an_x_ray_skeleton_has_them() {
    // GraspDB14 skeleton, right hand, mm from the wrist joint 20 mm behind the crease, for a hand
    // of length 180 mm.
    let skeleton = [(-81.0, 121.0), (-33.0, 187.0), (0.0, 200.0), (28.0, 189.0), (53.0, 156.0)];
    for (finger, (x, y)) in flat_hand().fingers.iter().zip(skeleton) {
        let expected = Point3::new(x, y - 20.0, 0.0) * (185.0 / 180.0 * 1e-3);
        let off = (finger.tip().xy() - expected.xy()).norm();
        assert!(off < 0.012, "{:?} tip {} is {off} m off", finger.finger, finger.tip());
    }
}

#[test]
fn flat_fingers_fan_out_in_order() {
    let tips = flat_hand().fingers.map(|f| f.tip());
    for pair in tips.windows(2) {
        assert!(pair[0].x < pair[1].x, "thumb side is -X on a right hand");
    }
    for tip in &tips[1..] {
        assert_eq!(tip.z, 0.0);
    }
}

#[test]
fn palm_arch_moves_only_ring_and_little_finger_toward_the_palm() {
    let angles = JointAngles { palm_arch: 0.5, ..JointAngles::flat() };
    let cupped = pose(&HandDimensions::default(), &angles, Isometry3::identity());
    let drops: Vec<f64> = (0..5)
        .map(|i| {
            flat_hand().fingers[i].segments[0].start().z - cupped.fingers[i].segments[0].start().z
        })
        .collect();
    assert_eq!(drops[..3], [0.0; 3]);
    assert!(0.003 < drops[3] && drops[3] < drops[4] && drops[4] < 0.02, "{drops:?}");
}

#[test]
fn thumb_swings_in_front_of_the_palm_with_its_pulp_to_the_fingers() {
    let mut angles = JointAngles::flat();
    angles.thumb.rotation = 1.4;
    let opposed = pose(&HandDimensions::default(), &angles, Isometry3::identity());
    let thumb = opposed.finger(Finger::Thumb);
    let flat = flat_hand();
    assert!(thumb.tip().z < flat.finger(Finger::Thumb).tip().z - 0.03);
    assert!(thumb.contact_point.z > thumb.tip_centre.z, "pulp looks back at the palm");
}

/// Ranges of thumb rotation, abduction, MPJ, IJ and index abduction, MPJ, PIJ, DIJ, in degrees: the
/// active ranges of the KINE-ADL study, thumb rotation as in the glove vendor's own limits.
const PINCH_RANGE_DEG: [[f64; 2]; 8] = [
    [0.0, 90.0],
    [-20.0, 20.5],
    [-23.7, 31.8],
    [-39.0, 75.2],
    [-17.0, 17.0],
    [-17.0, 67.6],
    [-1.9, 107.2],
    [0.0, 80.0],
];

/// Slots of [`JointAngles::to_array`] in the order of [`PINCH_RANGE_DEG`].
const PINCH_SLOTS: [usize; 8] = [0, 3, 1, 2, 7, 4, 5, 6];

/// Damped least squares on the gap between thumb and index contact point, inside the ranges.
fn pinch(hand: &HandDimensions) -> HandPose {
    let palm = Isometry3::identity();
    let mut array = JointAngles::flat().lerp(&JointAngles::fist(), 0.5).to_array();
    for _ in 0..200 {
        let angles = JointAngles::from_array(&array);
        let posed = pose(hand, &angles, palm);
        let gap = posed.fingers[0].contact_point - posed.fingers[1].contact_point;
        let thumb = contact_jacobian(hand, &angles, &palm, Finger::Thumb);
        let index = contact_jacobian(hand, &angles, &palm, Finger::Index);
        let normal =
            thumb * thumb.transpose() + index * index.transpose() + Matrix3::identity() * 1e-6;
        let pull = normal.try_inverse().unwrap() * gap;
        for column in 0..8 {
            let step = match column {
                0..4 => -thumb.column(column).dot(&pull),
                _ => index.column(column - 4).dot(&pull),
            };
            let [low, high] = PINCH_RANGE_DEG[column].map(f64::to_radians);
            let value = &mut array[PINCH_SLOTS[column]];
            *value = (*value + step).clamp(low, high);
        }
    }
    pose(hand, &JointAngles::from_array(&array), palm)
}

#[test]
fn thumb_and_index_pulps_meet_within_their_active_ranges() {
    for (length, breadth) in [(0.166, 0.075), (0.185, 0.084), (0.2, 0.09)] {
        let hand = HandDimensions::scaled(length, breadth).unwrap();
        let pinched = pinch(&hand);
        let [thumb, index] = [&pinched.fingers[0], &pinched.fingers[1]];
        assert!((thumb.contact_point - index.contact_point).norm() < 1e-4);
        // Pulp to pulp: the two spheres touch from outside instead of lying in each other.
        let radii = hand.thumb.tip_radius + hand.fingers[0].tip_radius;
        let centres = (thumb.tip_centre - index.tip_centre).norm();
        assert!(centres > 0.6 * radii, "centres {centres} m apart, radii {radii} m together");
    }
}

#[test]
fn straight_wrist_puts_palm_and_forearm_together() {
    let angles = JointAngles { wrist_pitch: 0.4, wrist_yaw: 0.2, ..JointAngles::flat() };
    let straight = forearm_from_palm(&JointAngles::fist(), Handedness::Right);
    assert_eq!(straight, Isometry3::identity());
    let ahead = |side| forearm_from_palm(&angles, side) * Vector3::y();
    assert!(ahead(Handedness::Right).z < -0.3, "pitch bends toward the palm");
    assert!(ahead(Handedness::Right).x < -0.1, "yaw turns toward the thumb at -X");
    assert!(ahead(Handedness::Left).x > 0.1, "and at +X on a left hand");
}
