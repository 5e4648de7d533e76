//! Place of an object when the hand comes: its home, or between thumb and fingers.

use nalgebra::{Isometry3, Point3, Translation3, Vector3};
use softgrasp_grasp::hand::{HandDimensions, HandPose, JointAngles, clearance, hand_bodies, pose};
use softgrasp_grasp::object::SoftObject;

/// Number of postures between the present hand and a fist, in which the distance of thumb and fingers is
/// measured, and the part of this motion that is used.
const POSTURES: u32 = 24;
const CLOSES_MAX: f64 = 0.7;
/// Least distance between hand and object, m.
const ROOM_M: f64 = 3e-3;
/// Length of the steps by which the object is moved away from the palm until there is room, m.
const STEP_M: f64 = 2e-3;
/// Largest distance by which the object is moved away from the palm, m.
const AWAY_MAX_M: f64 = 0.2;

/// Pose of an object, oriented as at rest, between thumb and fingers of a closing hand, moved out of the
/// palm until there is room for it beside the present hand.
pub(crate) fn where_it_closes(
    dimensions: &HandDimensions,
    angles: &JointAngles,
    hand: &HandPose,
    object: &SoftObject,
) -> Isometry3<f64> {
    let centre = object.rest_shape().centre();
    let (low, high) = object.rest().bounds();
    let width = (high - low).min();
    let between = between_the_tips(dimensions, angles, hand, width);
    let bodies = hand_bodies(dimensions, hand);
    let out_of_palm = hand.world_from_palm * -Vector3::z();
    let at = |away: f64| Isometry3::from(Translation3::from(between + away * out_of_palm - centre));
    let has_room = |pose: &Isometry3<f64>| {
        let surface = object.surface().nodes.iter();
        // The surface of an object that encloses a segment is farther from it than its size.
        clearance(&bodies, surface.map(|&node| pose * object.shape()[node as usize])) > ROOM_M
            && bodies.iter().all(|body| {
                body.ends().iter().all(|end| (end - pose * centre).norm() > 0.5 * width)
            })
    };
    let steps = (AWAY_MAX_M / STEP_M) as u32;
    let poses = (0..steps).map(|step| at(STEP_M * f64::from(step)));
    poses.into_iter().find(has_room).unwrap_or_else(|| at(AWAY_MAX_M))
}

/// Point between the tips of the thumb and of index and middle finger, in the posture of a closing hand
/// in which they are as far apart as the object is wide.
///
/// Units: m. Frame: world.
fn between_the_tips(
    dimensions: &HandDimensions,
    angles: &JointAngles,
    hand: &HandPose,
    width: f64,
) -> Point3<f64> {
    let radii = dimensions.tip_radii();
    let tips = (0..=POSTURES).map(|posture| {
        let closed = CLOSES_MAX * f64::from(posture) / f64::from(POSTURES);
        let closing =
            pose(dimensions, &angles.lerp(&JointAngles::fist(), closed), hand.world_from_palm);
        let [thumb, index, middle, ..] = closing.fingers.map(|finger| finger.tip_centre);
        let fingers = nalgebra::center(&index, &middle);
        let room = (thumb - fingers).norm() - radii[0] - radii[1];
        ((room - width).abs(), nalgebra::center(&thumb, &fingers))
    });
    let nearest = tips.min_by(|a, b| a.0.total_cmp(&b.0));
    nearest.map_or_else(|| hand.world_from_palm * Point3::origin(), |(_, between)| between)
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::UnitQuaternion;
    use softgrasp_core::mesh::{BuiltIn, generate};

    #[test]
    fn object_is_put_in_front_of_the_palm_and_touches_no_segment() {
        let dimensions = HandDimensions::default();
        let object = SoftObject::try_new(generate(BuiltIn::Sphere, 300).unwrap()).unwrap();
        for turn in 0..6 {
            let rotation = UnitQuaternion::from_euler_angles(f64::from(turn), 0.5, 0.2);
            let palm = Isometry3::from_parts(Translation3::new(0.3, -0.1, 0.2), rotation);
            let angles = JointAngles::from_array(&[0.1 * f64::from(turn); 23]);
            let hand = pose(&dimensions, &angles, palm);
            let placed = where_it_closes(&dimensions, &angles, &hand, &object);
            let centre = placed * object.rest_shape().centre();
            let in_palm = palm.inverse_transform_point(&centre);
            assert!(in_palm.z < -0.02, "turn {turn}: {in_palm}");
            assert!(in_palm.y > 0.2 * dimensions.hand_length, "turn {turn}: {in_palm}");
            let shape = object.shape().iter().map(|vertex| placed * vertex);
            assert!(clearance(&hand_bodies(&dimensions, &hand), shape) > 0.0, "turn {turn}");
        }
    }
}
