//! Finds what each finger touches, from the hand's colliders and the sphere tree.

use nalgebra::{Isometry3, Point3, Vector3};

use crate::hand::HandColliders;
use crate::sphere_tree::{Closeness, ContactHit, SphereTree, TIP_HITS_MAX, tip_hits};

/// What one finger touches in one tick, by its colliders and the sphere tree.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FingerInput {
    /// Whether each segment penetrates the object, from the palm outward.
    pub segments_collide: [bool; 3],
    /// Whether no part of the finger is within the release margin of the object.
    pub clear: bool,
    /// Vertices the tip is inside of, nearest first; all `None` when it is outside.
    pub tip_hits: [Option<ContactHit>; TIP_HITS_MAX],
    /// Contact point of the fingertip, m.
    pub tip_in_object: Point3<f64>,
}

/// Tests five fingers against the object, thumb first.
///
/// The distal segment is its cylinder and its hemisphere together (thesis 4.4.2).
///
/// Shapes: `normals` by mesh node. Units: m. Frames: `tree` and `normals` in the object's frame,
/// `hand` in the world's; `margin` is the grasp's release margin.
pub fn sense(
    tree: &SphereTree,
    normals: &[Vector3<f64>],
    hand: &HandColliders,
    world_from_object: &Isometry3<f64>,
    margin: f64,
) -> [FingerInput; 5] {
    hand.in_frame(&world_from_object.inverse()).fingers.map(|finger| {
        let mut closeness = finger.cylinders.map(|s| tree.closeness_to_cylinder(&s, margin));
        closeness[2] = closeness[2].max(tree.closeness_to_sphere(&finger.tip, margin));
        let tip_hits = tip_hits(tree, normals, &finger.tip, &finger.contact_point);
        FingerInput {
            segments_collide: closeness.map(|c| c == Closeness::Colliding),
            clear: closeness == [Closeness::Clear; 3] && tip_hits[0].is_none(),
            tip_hits,
            tip_in_object: finger.contact_point,
        }
    })
}
