//! The hand that searches: it closes around the object, from four sides.

use nalgebra::{Isometry3, Rotation3, Translation3, UnitQuaternion, Vector3};
use softgrasp_core::hand::{HandColliders, HandDimensions, JointAngles, pose};

/// Colliders of a hand in one pose, in the object's frame.
pub(super) type Poses = Vec<HandColliders>;

/// Where the object's centre is in the palm's frame: in front of the palm, below the fingers.
const OBJECT_IN_PALM: [f64; 3] = [0.0, 0.105, -0.045];
const SIDES: usize = 4;
const CLOSURES: usize = 8;

/// Thirty-two poses, from a flat hand to a fist, from four sides.
///
/// Units: m. Frame: the object's, its centre at the origin.
pub(super) fn poses() -> Poses {
    let dimensions = HandDimensions::default();
    let closure = |step: usize| step as f64 / (CLOSURES - 1) as f64;
    let side = |index: usize| {
        let turn = std::f64::consts::TAU * index as f64 / SIDES as f64;
        let tilt = Rotation3::from_axis_angle(&Vector3::x_axis(), 0.3 * index as f64);
        let rotation = Rotation3::from_axis_angle(&Vector3::y_axis(), turn) * tilt;
        let palm_at = rotation * -Vector3::from(OBJECT_IN_PALM);
        Isometry3::from_parts(
            Translation3::from(palm_at),
            UnitQuaternion::from_rotation_matrix(&rotation),
        )
    };
    (0..SIDES)
        .flat_map(|index| (0..CLOSURES).map(move |step| (side(index), closure(step))))
        .map(|(object_from_palm, closed)| {
            let angles = JointAngles::flat().lerp(&JointAngles::fist(), closed);
            HandColliders::new(&dimensions, &pose(&dimensions, &angles, object_from_palm))
        })
        .collect()
}
