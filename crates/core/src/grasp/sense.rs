//! From the hand's colliders and the sphere tree to what each finger touches.

use nalgebra::{Isometry3, Point3, Vector3};

use crate::shape::{Cylinder, Sphere};
use crate::sphere_tree::{Closeness, ContactHit, SphereTree, TIP_HITS_MAX, tip_hits};

/// One finger as collision sees it, in any one frame.
///
/// Source: thesis 4.4.1, Figure 4.14.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FingerColliders {
    /// A cylinder per segment, from the palm outward.
    pub segments: [Cylinder; 3],
    /// Sphere of the fingertip's hemisphere.
    pub tip: Sphere,
    /// The one point of the fingertip that contacts the object.
    pub contact_point: Point3<f64>,
}

/// What one finger touches in one tick.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FingerInput {
    /// Whether each segment penetrates the object, from the palm outward.
    pub segments_collide: [bool; 3],
    /// Whether no part of the finger is within the release margin of the object.
    pub clear: bool,
    /// Vertices the tip is inside of, nearest first; all `None` when it is outside.
    pub tip_hits: [Option<ContactHit>; TIP_HITS_MAX],
    /// The contact point, m.
    pub tip_in_object: Point3<f64>,
}

/// Tests five fingers against the object, thumb first.
///
/// The distal segment is its cylinder and its hemisphere together (thesis 4.4.2).
///
/// Shapes: `normals` by mesh node. Units: m. Frames: `tree` and `normals` in the object's frame,
/// `fingers` in the world's; `margin` is the grasp's release margin.
pub fn sense(
    tree: &SphereTree,
    normals: &[Vector3<f64>],
    fingers: &[FingerColliders; 5],
    world_from_object: &Isometry3<f64>,
    margin: f64,
) -> [FingerInput; 5] {
    let object_from_world = world_from_object.inverse();
    fingers.map(|finger_in_world| {
        let finger = finger_in_world.in_frame(&object_from_world);
        let mut closeness = finger.segments.map(|s| tree.closeness_to_cylinder(&s, margin));
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

impl FingerColliders {
    /// The same finger in another frame.
    pub fn in_frame(&self, target_from_current: &Isometry3<f64>) -> Self {
        let at = |point: &Point3<f64>| target_from_current * point;
        Self {
            segments: self.segments.map(|s| Cylinder {
                base: at(&s.base),
                axis: target_from_current.rotation * s.axis,
                ..s
            }),
            tip: Sphere { centre: at(&self.tip.centre), ..self.tip },
            contact_point: at(&self.contact_point),
        }
    }
}
