//! What the pointer points at: the hand, the object, or nothing.

use nalgebra::{Point3, Vector3};
use softgrasp_grasp::shape::Cylinder;

use super::frame::{HandView, ViewFrame};
use super::ray_hit::ray_hit;

/// What lies under the mouse pointer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PointedAt {
    /// The hand lies there.
    Hand,
    /// The object lies there.
    Object,
    /// Neither hand nor object lies there.
    Nothing,
}

/// The skin reaches so far beyond the colliders, and a person does not point more exactly, m.
const HAND_MARGIN_M: f64 = 0.004;
/// The palm is taken for a ball around its middle, m.
const PALM_RADIUS_M: f64 = 0.042;
/// Middle of the palm from the wrist, in parts of the hand's length.
const PALM_MIDDLE: f64 = 0.24;

/// What a ray meets first: hand, object or nothing.
///
/// Units: m. Frame: world; `direction` has length 1.
pub fn pointed_at(frame: &ViewFrame, origin: &Point3<f64>, direction: &Vector3<f64>) -> PointedAt {
    let distances = frame.hands().filter_map(|hand| hand_distance(hand, origin, direction));
    let hand = distances.min_by(f64::total_cmp);
    let object = object_distance(frame, origin, direction);
    match (hand, object) {
        (None, None) => PointedAt::Nothing,
        (Some(hand), Some(object)) if object < hand => PointedAt::Object,
        (None, Some(_)) => PointedAt::Object,
        (Some(_), _) => PointedAt::Hand,
    }
}

fn hand_distance(hand: &HandView, origin: &Point3<f64>, direction: &Vector3<f64>) -> Option<f64> {
    let colliders = hand.colliders();
    let cylinders = colliders.fingers.iter().flat_map(|finger| &finger.cylinders);
    let fingers = cylinders.filter_map(|cylinder| capsule_distance(cylinder, origin, direction));
    let middle = Point3::new(0.0, PALM_MIDDLE * hand.dimensions.hand_length, 0.0);
    let palm = sphere_distance(&(hand.world_from_palm * middle), PALM_RADIUS_M, origin, direction);
    fingers.chain(palm).min_by(f64::total_cmp)
}

/// Distance along the ray to where it is nearest to the cylinder's axis, if that is within it.
fn capsule_distance(
    cylinder: &Cylinder,
    origin: &Point3<f64>,
    direction: &Vector3<f64>,
) -> Option<f64> {
    let axis = cylinder.axis.into_inner();
    let between = origin - cylinder.base;
    let (b, d, e) = (direction.dot(&axis), direction.dot(&between), axis.dot(&between));
    let across = 1.0 - b * b;
    // A ray along the axis is nearest everywhere; its beginning will do.
    let on_axis = if across < 1e-9 { 0.0 } else { (e - b * d) / across };
    let on_axis = on_axis.clamp(0.0, cylinder.length);
    let nearest = cylinder.base + axis * on_axis;
    sphere_distance(&nearest, cylinder.radius + HAND_MARGIN_M, origin, direction)
}

fn sphere_distance(
    centre: &Point3<f64>,
    radius: f64,
    origin: &Point3<f64>,
    direction: &Vector3<f64>,
) -> Option<f64> {
    let to_centre = centre - origin;
    let along = to_centre.dot(direction);
    let off_squared = to_centre.norm_squared() - along * along;
    let inside = radius * radius - off_squared;
    (along > 0.0 && inside >= 0.0).then(|| along - inside.sqrt())
}

fn object_distance(
    frame: &ViewFrame,
    origin: &Point3<f64>,
    direction: &Vector3<f64>,
) -> Option<f64> {
    let hits = frame.objects().filter_map(|object| {
        let object_from_world = object.world_from_object.inverse();
        let (origin, direction) = (object_from_world * origin, object_from_world * direction);
        let shape = object.shape();
        let triangles = object.rest.surface().triangles.iter();
        let hits = triangles.filter_map(|corners| {
            let corners = corners.map(|node| shape[node as usize]);
            ray_hit(&corners, &origin, &direction).map(|(distance, _)| distance)
        });
        hits.min_by(f64::total_cmp)
    });
    hits.min_by(f64::total_cmp)
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Unit;

    #[test]
    fn what_lies_in_front_is_what_is_pointed_at() {
        use crate::view::frame::samples::frame;
        use nalgebra::{Isometry3, Translation3};
        use softgrasp_grasp::hand::{HandDimensions, JointAngles, pose};

        let mut frame = frame(0);
        let from = Point3::new(0.0, 0.0, 1.0);
        assert_eq!(pointed_at(&frame, &from, &-Vector3::z()), PointedAt::Object);
        let dimensions = HandDimensions::default();
        let mut with_palm_at = |z: f64| {
            let palm = Isometry3::from_parts(Translation3::new(0.0, -0.05, z), Default::default());
            let hand = pose(&dimensions, &JointAngles::flat(), palm);
            frame.hand = Some(HandView::of_pose(dimensions, &hand));
            pointed_at(&frame, &from, &-Vector3::z())
        };
        assert_eq!(with_palm_at(0.2), PointedAt::Hand);
        assert_eq!(with_palm_at(-0.2), PointedAt::Object);
        let aside = Vector3::new(1.0, 0.0, -0.5).normalize();
        assert_eq!(pointed_at(&frame, &from, &aside), PointedAt::Nothing);
    }

    #[test]
    fn object_beside_the_first_is_pointed_at_too() {
        use crate::view::frame::ObjectView;
        use crate::view::frame::samples::frame;

        let mut frame = frame(0);
        let (from, down) = (Point3::new(0.2, 0.0, 1.0), -Vector3::z());
        assert_eq!(pointed_at(&frame, &from, &down), PointedAt::Nothing);
        frame.others = vec![ObjectView {
            number: 1,
            world_from_object: nalgebra::Isometry3::translation(0.2, 0.0, 0.0),
            ..frame.object.clone()
        }];
        assert_eq!(pointed_at(&frame, &from, &down), PointedAt::Object);
    }

    #[test]
    fn capsule_is_met_beside_its_axis_and_not_further_off() {
        let cylinder = Cylinder {
            base: Point3::origin(),
            axis: Unit::new_normalize(Vector3::y()),
            length: 0.04,
            radius: 0.008,
        };
        let meets = |x: f64, y: f64| {
            capsule_distance(&cylinder, &Point3::new(x, y, 1.0), &-Vector3::z()).is_some()
        };
        assert!(meets(0.0, 0.02) && meets(0.011, 0.01) && meets(0.0, 0.05));
        assert!(!meets(0.013, 0.02) && !meets(0.0, 0.06));
        // Along the axis.
        let along = capsule_distance(&cylinder, &Point3::new(0.0, 1.0, 0.0), &-Vector3::y());
        assert!(along.is_some());
    }
}
