//! A first guess of a hand's pose from a record alone: palm by a rigid fit, angles by the bones.

use nalgebra::{Isometry3, Matrix3, Point3, UnitQuaternion, Vector3};
use softgrasp_grasp::hand::{Finger, FingerAngles, HandDimensions, JointAngles, ThumbAngles};

use super::limits::AngleLimits;
use super::places::{mirrored, wrist_in_palm};
use super::record::{JointsRecord, WRIST, digit_joints};
use super::rigid::{Pair, rigid_fit, spread_beside_a_line};

/// Joints that a palm must have at least.
pub(super) const PALM_JOINTS_NEEDED: usize = 3;
/// Smallest spread of these joints beside a straight line, m.
pub(super) const PALM_SPREAD_NEEDED_M: f64 = 0.01;

/// The tracked joints that are fixed to the palm, each with its place in the palm frame.
#[derive(Clone, Debug)]
pub(super) struct PalmJoints {
    pairs: Vec<Pair>,
    has_wrist_or_thumb: bool,
}

impl PalmJoints {
    /// Wrist, thumb's metacarpal joint and knuckles, as far as they are tracked.
    ///
    /// `palm_arch` says where the knuckles of ring and little finger are.
    pub(super) fn new(
        record: &JointsRecord,
        dimensions: &HandDimensions,
        palm_arch: f64,
        weight: impl Fn(usize) -> f64,
    ) -> Self {
        let side = dimensions.handedness;
        let arched = |finger: Finger| {
            let finger = &dimensions.fingers[finger.index() - 1];
            about(&Vector3::y_axis(), finger.arch_share * palm_arch) * finger.mcp_in_palm
        };
        let knuckles = Finger::ALL[1..].iter().map(|&f| (digit_joints(f)[0], arched(f)));
        let thumb = (digit_joints(Finger::Thumb)[0], dimensions.thumb.tmj_in_palm);
        let fixed = [(WRIST, wrist_in_palm(dimensions)), thumb].into_iter().chain(knuckles);
        let pair = |(joint, in_right_palm)| {
            let from = mirrored(side, in_right_palm);
            Some(Pair { from, to: record.position(joint)?, weight: weight(joint) })
        };
        let beside_knuckles = [WRIST, thumb.0].into_iter();
        Self {
            pairs: fixed.filter_map(pair).collect(),
            has_wrist_or_thumb: beside_knuckles.filter_map(|j| record.position(j)).count() > 0,
        }
    }

    /// Number of these joints that are tracked.
    pub(super) fn count(&self) -> usize {
        self.pairs.len()
    }

    /// Whether these joints determine the pose of the palm.
    pub(super) fn are_enough(&self) -> bool {
        self.has_wrist_or_thumb
            && self.count() >= PALM_JOINTS_NEEDED
            && self.spread() >= PALM_SPREAD_NEEDED_M
    }

    /// How far these joints spread beside a straight line, m.
    pub(super) fn spread(&self) -> f64 {
        let places: Vec<Point3<f64>> = self.pairs.iter().map(|pair| pair.to).collect();
        spread_beside_a_line(&places)
    }

    /// Pose of the palm in the world that fits these joints best.
    pub(super) fn world_from_palm(&self) -> Option<Isometry3<f64>> {
        rigid_fit(&self.pairs)
    }
}

/// Angles that turn the bones as the record has them, within limits.
///
/// Bones that are not tracked are closed by the share `closed`, 0 (flat) to 1 (fist).
pub(super) fn angles_of_bones(
    record: &JointsRecord,
    dimensions: &HandDimensions,
    world_from_palm: &Isometry3<f64>,
    limits: &AngleLimits,
    closed: f64,
) -> JointAngles {
    let palm_from_world = world_from_palm.inverse();
    let ways = |finger: Finger| {
        let places = digit_joints(finger).map(|joint| record.position(joint));
        let way = |from: usize, to: usize| {
            let way = palm_from_world * (places[to]? - places[from]?);
            Some(mirrored(dimensions.handedness, Point3::from(way)).coords)
        };
        let bones = [way(0, 1), way(1, 2), way(2, 3)];
        Ways { bones, ahead: way(0, 1).or_else(|| way(0, 2)).or_else(|| way(0, 3)) }
    };
    let rest = JointAngles::flat().lerp(&JointAngles::fist(), closed);
    let finger = |finger: Finger, rest: &FingerAngles| {
        let fan = dimensions.fingers[finger.index() - 1].fan;
        let slot = 4 * finger.index() + 3;
        let range = [limits.low[slot], limits.high[slot]];
        finger_angles(&ways(finger), fan, range, rest)
    };
    let angles = JointAngles {
        thumb: thumb_angles(&ways(Finger::Thumb), dimensions, &rest.thumb),
        index: finger(Finger::Index, &rest.index),
        middle: finger(Finger::Middle, &rest.middle),
        ring: finger(Finger::Ring, &rest.ring),
        little: finger(Finger::Little, &rest.little),
        palm_arch: 0.0,
        wrist_pitch: 0.0,
        wrist_yaw: 0.0,
    };
    limits.clamp(&angles)
}

/// Vectors between the tracked joints of a digit, in the palm frame of a right hand, m.
struct Ways {
    /// Vectors from each joint to the next.
    bones: [Option<Vector3<f64>>; 3],
    /// Vector from the first joint to the next one that is tracked.
    ahead: Option<Vector3<f64>>,
}

fn finger_angles(ways: &Ways, fan: f64, range: [f64; 2], rest: &FingerAngles) -> FingerAngles {
    let Some(way) = ways.ahead else { return *rest };
    let [low, high] = range;
    let sideways = (-way.x).atan2(way.y) - fan;
    // A bone that points out of the palm, or back, says nothing about its sideways angle.
    let is_ahead = way.y > 0.3 * way.norm();
    let abduction = if is_ahead { sideways.clamp(low, high) } else { 0.0 };
    let turn = about(&Vector3::z_axis(), fan + abduction);
    let (ahead, hinge) = (turn * Vector3::y(), turn * Vector3::x());
    let [proximal, middle, distal] = ways.bones;
    // A way across two bones is bent by about half the angle between them.
    let bend = if proximal.is_some() { 0.0 } else { 0.5 * rest.pip_flexion };
    FingerAngles {
        mcp_flexion: (-way.z).atan2(way.dot(&ahead)) - bend,
        pip_flexion: flexion(proximal, middle, &hinge).unwrap_or(rest.pip_flexion),
        dip_flexion: flexion(middle, distal, &hinge).unwrap_or(rest.dip_flexion),
        abduction,
    }
}

fn thumb_angles(ways: &Ways, dimensions: &HandDimensions, rest: &ThumbAngles) -> ThumbAngles {
    let Some(way) = ways.ahead else { return *rest };
    let thumb = &dimensions.thumb;
    let x = (dimensions.fingers[0].mcp_in_palm - thumb.tmj_in_palm).normalize();
    let y = Vector3::z().cross(&x).normalize();
    let root = Matrix3::from_columns(&[x, y, x.cross(&y)]);
    let in_root = root.transpose() * way;
    let from_index = in_root.yz().norm().atan2(in_root.x);
    let rotation = (-in_root.z).atan2(in_root.y);
    // The hinge is X of the metacarpal: Z before the roll, turned about the bone.
    let swing = about(&Vector3::x_axis(), -rotation) * about(&Vector3::z_axis(), from_index);
    let hinge_at_rest = Vector3::new(0.0, -thumb.roll.cos(), thumb.roll.sin());
    let hinge = root * (swing * hinge_at_rest);
    let [metacarpal, proximal, distal] = ways.bones;
    ThumbAngles {
        rotation,
        abduction: from_index - thumb.fan,
        mcp_flexion: flexion(metacarpal, proximal, &hinge).unwrap_or(rest.mcp_flexion),
        ip_flexion: flexion(proximal, distal, &hinge).unwrap_or(rest.ip_flexion),
    }
}

/// Angle between two bones, positive when the second is turned about −`hinge`.
fn flexion(
    lower: Option<Vector3<f64>>,
    upper: Option<Vector3<f64>>,
    hinge: &Vector3<f64>,
) -> Option<f64> {
    let (lower, upper) = (lower?, upper?);
    let across = lower.cross(&upper);
    let bent = across.norm().atan2(lower.dot(&upper));
    Some(if across.dot(hinge) > 0.0 { -bent } else { bent })
}

fn about(axis: &nalgebra::Unit<Vector3<f64>>, angle: f64) -> UnitQuaternion<f64> {
    UnitQuaternion::from_axis_angle(axis, angle)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::joints::places::record_of_hand;
    use proptest::prelude::*;
    use softgrasp_grasp::hand::Handedness;

    proptest! {
        #[test]
        fn a_hand_with_a_flat_palm_gives_its_own_angles_back(
            values in prop::array::uniform23(0.05..1.3f64),
            abduction in prop::array::uniform4(-0.4..0.4f64),
            left in any::<bool>(),
            turn in prop::array::uniform3(-2.0..2.0f64),
        ) {
            let side = if left { Handedness::Left } else { Handedness::Right };
            let hand = HandDimensions::default().with_handedness(side);
            let mut angles = JointAngles::from_array(&values);
            angles.palm_arch = 0.0;
            (angles.wrist_pitch, angles.wrist_yaw) = (0.0, 0.0);
            angles.index.abduction = abduction[0];
            angles.middle.abduction = abduction[1];
            angles.ring.abduction = abduction[2];
            angles.little.abduction = abduction[3];
            angles.thumb.abduction *= 0.5;
            // Beyond that a knuckle says nothing about the sideways angle.
            for finger in
                [&mut angles.index, &mut angles.middle, &mut angles.ring, &mut angles.little]
            {
                finger.mcp_flexion *= 0.7;
            }
            let world_from_palm = Isometry3::new(Vector3::new(0.3, 1.0, -0.2), turn.into());
            let record = record_of_hand(&hand, &angles, &world_from_palm);
            let palm = PalmJoints::new(&record, &hand, 0.0, |_| 1.0).world_from_palm().unwrap();
            let found = angles_of_bones(&record, &hand, &palm, &AngleLimits::default(), 0.5);
            for (found, angle) in found.to_array().iter().zip(angles.to_array()) {
                prop_assert!((found - angle).abs() < 1e-6, "{found} is not {angle}");
            }
        }
    }
}
