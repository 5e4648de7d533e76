//! How the joints of the kinematic hand move when its palm and its angles change.

use nalgebra::{Point3, UnitQuaternion, Vector3};
use softgrasp_grasp::hand::{Finger, HandDimensions, HandPose, Handedness, JointAngles};

use super::places::{digit_places, mirrored};

/// Unknowns that every digit shares: palm shift (world X, Y, Z), palm turn about its own origin
/// (world X, Y, Z), palm arch.
pub(super) const SHARED: usize = 7;
/// Unknowns of one digit, in the order of [`JointAngles::to_array`].
pub(super) const PER_DIGIT: usize = 4;

/// Places of a digit's four joints and their derivatives.
///
/// Units: m, m/rad. Frame: world. The derivative by a palm shift is the shift itself.
#[derive(Clone, Copy, Debug)]
pub(super) struct DigitSlope {
    /// Places of the joints, from the palm to the tip.
    pub(super) places: [Point3<f64>; 4],
    /// Derivative of each joint's place by the palm arch.
    pub(super) by_arch: [Vector3<f64>; 4],
    /// Derivatives of each joint's place by the digit's own angles.
    pub(super) by_angle: [[Vector3<f64>; PER_DIGIT]; 4],
}

/// Places and derivatives of all five digits of a hand in one pose.
///
/// `posed` must be the pose of the same dimensions and angles.
pub(super) fn digit_slopes(
    dimensions: &HandDimensions,
    angles: &JointAngles,
    posed: &HandPose,
) -> [DigitSlope; 5] {
    let places = digit_places(posed);
    Finger::ALL.map(|finger| {
        let digit = finger.index();
        let axes = axes(dimensions, angles, posed, finger);
        let arch_axis = arch_axis(dimensions, posed, finger);
        let palm = posed.world_from_palm * Point3::origin();
        let places = places[digit];
        let by_angle = std::array::from_fn(|joint| {
            axes.map(|Axis { direction, at }| match joint > at {
                true => direction.cross(&(places[joint] - places[at])),
                false => Vector3::zeros(),
            })
        });
        DigitSlope { places, by_arch: places.map(|p| arch_axis.cross(&(p - palm))), by_angle }
    })
}

/// Direction in the world that an angle turns about, and the joint it passes through.
#[derive(Clone, Copy)]
struct Axis {
    direction: Vector3<f64>,
    at: usize,
}

/// The sign that a turn about Y or Z takes in the mirror.
fn sign(handedness: Handedness) -> f64 {
    match handedness {
        Handedness::Right => 1.0,
        Handedness::Left => -1.0,
    }
}

/// Axes of a digit's four angles.
fn axes(
    dimensions: &HandDimensions,
    angles: &JointAngles,
    posed: &HandPose,
    finger: Finger,
) -> [Axis; PER_DIGIT] {
    let side = dimensions.handedness;
    let segments = posed.finger(finger).segments.map(|s| s.world_from_segment.rotation);
    // Flexion turns about −X of the segment that it moves, on both hands.
    let flexion = |at: usize| Axis { direction: -(segments[at] * Vector3::x()), at };
    match angles.finger(finger) {
        Some(finger_angles) => {
            // The abduction axis is Z before the knuckle bends.
            let bend =
                UnitQuaternion::from_axis_angle(&Vector3::x_axis(), finger_angles.mcp_flexion);
            let direction = segments[0] * (bend * Vector3::z()) * sign(side);
            [flexion(0), flexion(1), flexion(2), Axis { direction, at: 0 }]
        }
        None => {
            let thumb = &dimensions.thumb;
            let to_index = dimensions.fingers[0].mcp_in_palm - thumb.tmj_in_palm;
            let to_index = mirrored(side, Point3::from(to_index.normalize()));
            let rotation = posed.world_from_palm.rotation * to_index.coords * -sign(side);
            // The abduction axis is Z of the metacarpal before its fixed roll.
            let unrolled = Vector3::new(sign(side) * thumb.roll.sin(), 0.0, thumb.roll.cos());
            let abduction = segments[0] * unrolled * sign(side);
            [
                Axis { direction: rotation, at: 0 },
                flexion(1),
                flexion(2),
                Axis { direction: abduction, at: 0 },
            ]
        }
    }
}

/// The axis of the palm arch through the palm's origin, as long as the finger's share of it.
fn arch_axis(dimensions: &HandDimensions, posed: &HandPose, finger: Finger) -> Vector3<f64> {
    let share = match finger {
        Finger::Thumb => 0.0,
        _ => dimensions.fingers[finger.index() - 1].arch_share,
    };
    let axis = posed.world_from_palm.rotation * Vector3::y();
    axis * (share * sign(dimensions.handedness))
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Isometry3;
    use proptest::prelude::*;
    use softgrasp_grasp::hand::{ANGLE_COUNT, pose};

    const ARCH_SLOT: usize = 20;

    proptest! {
        #[test]
        fn derivatives_equal_central_differences(
            values in prop::array::uniform23(-0.4..1.4f64),
            left in any::<bool>(),
            turn in prop::array::uniform3(-2.0..2.0f64),
        ) {
            let side = if left { Handedness::Left } else { Handedness::Right };
            let hand = HandDimensions::default().with_handedness(side);
            let world_from_palm = Isometry3::new(Vector3::new(0.3, 1.0, -0.2), turn.into());
            let angles = JointAngles::from_array(&values);
            let slopes = digit_slopes(&hand, &angles, &pose(&hand, &angles, world_from_palm));
            let difference = |slot: usize, digit: usize, joint: usize| {
                let at = |delta: f64| {
                    let mut moved: [f64; ANGLE_COUNT] = values;
                    moved[slot] += delta;
                    let posed = pose(&hand, &JointAngles::from_array(&moved), world_from_palm);
                    digit_places(&posed)[digit][joint]
                };
                (at(1e-6) - at(-1e-6)) / 2e-6
            };
            for (digit, slope) in slopes.iter().enumerate() {
                for joint in 0..4 {
                    let by_arch = difference(ARCH_SLOT, digit, joint);
                    prop_assert!((slope.by_arch[joint] - by_arch).norm() < 1e-8);
                    for angle in 0..PER_DIGIT {
                        let by_angle = difference(PER_DIGIT * digit + angle, digit, joint);
                        prop_assert!((slope.by_angle[joint][angle] - by_angle).norm() < 1e-8);
                    }
                }
            }
        }
    }
}
