//! The poses of hands that close around the object until their fingertips are inside it.

use nalgebra::{Isometry3, Point3, Rotation3, Translation3, UnitQuaternion, Vector3};
use softgrasp_grasp::hand::{HandColliders, HandDimensions, JointAngles, pose};

use super::brute::contact;

/// Colliders of a hand in one pose, in the object's frame.
pub(super) type Poses = Vec<HandColliders>;

/// Positions of the object's centre in the palm's frame, m: distance along the fingers and in front of
/// the palm; farthest first.
const ALONG: [f64; 5] = [0.12, 0.11, 0.10, 0.09, 0.08];
const IN_FRONT: [f64; 5] = [0.055, 0.05, 0.045, 0.04, 0.035];
/// Number of sides from which the object is grasped.
const SIDES: usize = 4;
/// Number of steps from a flat hand to a fist; about 2 mm each at a fingertip.
const STEPS: usize = 40;
/// Poses of each side, in steps from the contact of every fingertip; negative before the contact.
const FROM_CONTACT: [f64; 8] = [-6.0, -4.0, -2.0, -1.0, 0.0, 1.0, 2.0, 3.0];
/// Closure of a finger that finds no contact.
const OPEN: f64 = 0.3;

/// Thirty-two poses: from four sides, each finger from before its contact to some steps behind it.
///
/// On each side the palm stands where most fingertips find a contact.
///
/// Shapes: `points` and `normals` one per vertex of the surface. Units: m. Frame: the object's, its
/// centre at the origin.
pub(super) fn poses(points: &[Point3<f64>], normals: &[Vector3<f64>]) -> Poses {
    let mut poses = Poses::new();
    for index in 0..SIDES {
        let places = IN_FRONT.iter().flat_map(|z| ALONG.iter().map(move |y| [0.0, *y, -z]));
        let mut best: Option<(usize, Isometry3<f64>, [f64; 5])> = None;
        for object_in_palm in places {
            let object_from_palm = side(index, object_in_palm);
            let touch = touches(object_from_palm, points, normals);
            let count = touch.iter().flatten().count();
            if best.as_ref().is_none_or(|(most, _, _)| count > *most) {
                best = Some((count, object_from_palm, touch.map(|s| s.unwrap_or(OPEN))));
            }
        }
        let Some((_, object_from_palm, touch)) = best else { continue };
        for steps in FROM_CONTACT {
            let closure = touch.map(|s| (s + steps / STEPS as f64).clamp(0.0, 1.0));
            poses.push(closed_hand(object_from_palm, &closure));
        }
    }
    poses
}

/// Closure at which each fingertip first touches, thumb first.
fn touches(
    object_from_palm: Isometry3<f64>,
    points: &[Point3<f64>],
    normals: &[Vector3<f64>],
) -> [Option<f64>; 5] {
    let mut touch = [None; 5];
    for step in 0..=STEPS {
        let closure = step as f64 / STEPS as f64;
        let hand = closed_hand(object_from_palm, &[closure; 5]);
        for (touch, finger) in touch.iter_mut().zip(&hand.fingers) {
            if touch.is_none() && contact(finger, points, normals).is_some() {
                *touch = Some(closure);
            }
        }
    }
    touch
}

/// Palm pose that looks at the object from one side.
fn side(index: usize, object_in_palm: [f64; 3]) -> Isometry3<f64> {
    let turn = std::f64::consts::TAU * index as f64 / SIDES as f64;
    let tilt = Rotation3::from_axis_angle(&Vector3::x_axis(), 0.3 * index as f64);
    let rotation = Rotation3::from_axis_angle(&Vector3::y_axis(), turn) * tilt;
    let palm_at = rotation * -Vector3::from(object_in_palm);
    Isometry3::from_parts(
        Translation3::from(palm_at),
        UnitQuaternion::from_rotation_matrix(&rotation),
    )
}

/// Hand whose fingers have closed by these shares, thumb first.
fn closed_hand(object_from_palm: Isometry3<f64>, closure: &[f64; 5]) -> HandColliders {
    let dimensions = HandDimensions::default();
    let at = |digit: usize| JointAngles::flat().lerp(&JointAngles::fist(), closure[digit]);
    let angles = JointAngles {
        thumb: at(0).thumb,
        index: at(1).index,
        middle: at(2).middle,
        ring: at(3).ring,
        little: at(4).little,
        ..JointAngles::flat()
    };
    HandColliders::new(&dimensions, &pose(&dimensions, &angles, object_from_palm))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::collision::skin::Skin;
    use softgrasp_core::mesh::BuiltIn;
    use softgrasp_grasp::sphere_tree::vertex_normals;

    #[test]
    fn fingertips_touch_every_object_that_is_measured() {
        for shape in [BuiltIn::Sphere, BuiltIn::Strawberry] {
            let skin = Skin::try_new(shape, 500).unwrap();
            let mut normals = Vec::new();
            vertex_normals(&skin.points, &skin.triangles, &mut normals).unwrap();
            let poses = poses(&skin.points, &normals);
            assert_eq!(poses.len(), 32);
            let touching = |hand: &HandColliders| {
                let is_in = |f| contact(f, &skin.points, &normals).is_some();
                hand.fingers.iter().filter(|f| is_in(f)).count()
            };
            let most = poses.iter().map(touching).max().unwrap();
            assert!(most >= 3, "{shape}: at most {most} tips touch");
            let all: usize = poses.iter().map(touching).sum();
            assert!((10..160).contains(&all), "{shape}: {all} touches");
        }
    }
}
