//! The derivative of a fingertip's contact point by the angle of one joint.

use nalgebra::{Isometry3, Matrix3x4, Point3, Vector3};

use super::dimensions::{HandDimensions, Handedness};
use super::joints::{Finger, JointAngles};
use super::kinematics::{about_x, contact_in_distal, right_chain, thumb_root};

/// Derivative of a finger's contact point by its own four joint angles.
///
/// Shapes: 3 × 4; columns are abduction, MPJ, PIJ, DIJ flexion, for the thumb rotation,
/// abduction, MPJ, IJ flexion. Units: m/rad. Frame: world. Palm arch and wrist are held.
///
/// Each column is axis × lever: the joint's axis crossed with the way from joint to contact point.
pub fn contact_jacobian(
    dimensions: &HandDimensions,
    angles: &JointAngles,
    world_from_palm: &Isometry3<f64>,
    finger: Finger,
) -> Matrix3x4<f64> {
    let chain = right_chain(dimensions, angles, finger);
    let digit = finger.index();
    let distal = chain[2];
    let lengths = dimensions.segment_lengths()[digit];
    let contact = distal * contact_in_distal(lengths, dimensions.tip_radii()[digit]);
    let joint = |i: usize| chain[i] * Point3::origin();
    // Flexion turns about −X of the segment it moves.
    let flexion = |i: usize| (-(chain[i] * Vector3::x())).cross(&(contact - joint(i)));

    let lever = contact - joint(0);
    let columns = match angles.finger(finger) {
        Some(finger_angles) => {
            // The abduction axis is Z before the MPJ bends.
            let before_flexion = chain[0].rotation * about_x(finger_angles.mcp_flexion);
            let abduction = (before_flexion * Vector3::z()).cross(&lever);
            [abduction, flexion(0), flexion(1), flexion(2)]
        }
        None => {
            let root = thumb_root(&dimensions.thumb, &dimensions.fingers[0]).rotation;
            let rotation_axis = -(root * Vector3::x());
            let abduction_axis = root * about_x(-angles.thumb.rotation) * Vector3::z();
            let rotation = rotation_axis.cross(&lever);
            [rotation, abduction_axis.cross(&lever), flexion(1), flexion(2)]
        }
    };
    Matrix3x4::from_columns(&columns.map(|column| {
        let handed = match dimensions.handedness {
            Handedness::Right => column,
            Handedness::Left => Vector3::new(-column.x, column.y, column.z),
        };
        world_from_palm * handed
    }))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::hand::{ANGLE_COUNT, pose};
    use proptest::prelude::*;

    /// Positions in [`JointAngles::to_array`] of a digit's four Jacobian columns.
    fn slots(finger: Finger) -> [usize; 4] {
        match finger {
            Finger::Thumb => [0, 3, 1, 2],
            _ => {
                let base = 4 * finger.index();
                [base + 3, base, base + 1, base + 2]
            }
        }
    }

    proptest! {
        #[test]
        fn jacobian_equals_central_differences(
            values in prop::array::uniform23(-0.4..1.2f64),
            digit in 0usize..5,
            left in any::<bool>(),
            turn in prop::array::uniform3(-2.0..2.0f64),
        ) {
            let finger = Finger::ALL[digit];
            let side = if left { Handedness::Left } else { Handedness::Right };
            let hand = HandDimensions::default().with_handedness(side);
            let world_from_palm = Isometry3::new(Vector3::new(0.3, 1.0, -0.2), turn.into());
            let angles = JointAngles::from_array(&values);
            let exact = contact_jacobian(&hand, &angles, &world_from_palm, finger);
            let step = 1e-6;
            for (column, slot) in slots(finger).into_iter().enumerate() {
                let at = |delta: f64| {
                    let mut moved: [f64; ANGLE_COUNT] = values;
                    moved[slot] += delta;
                    let moved = JointAngles::from_array(&moved);
                    pose(&hand, &moved, world_from_palm).fingers[digit].contact_point
                };
                let difference = (at(step) - at(-step)) / (2.0 * step);
                prop_assert!((exact.column(column) - difference).norm() < 1e-8);
            }
        }
    }
}
