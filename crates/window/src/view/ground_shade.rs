//! What stands above the ground and darkens it where no shadows are computed.

use nalgebra::{Isometry3, Point3, Vector3};

use super::frame::{HandView, ViewFrame};

/// Most capsules that darken the ground: the objects, and the palms and the fingers of the hands.
pub const MAX_CAPSULES: usize = 24;
/// Radius of the palm, m.
const PALM_RADIUS_M: f64 = 0.026;

/// A capsule: a line with a radius; one that ends where it begins is a sphere.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Capsule {
    begin: Point3<f64>,
    end: Point3<f64>,
    radius: f64,
}

impl Capsule {
    /// Beginning and radius, then the end, as they are drawn with so many units per metre.
    ///
    /// Frame: world.
    pub fn scaled(&self, units_per_m: f32) -> [f32; 8] {
        let [begin, end] = [self.begin, self.end].map(|p| p.coords.map(|x| x as f32 * units_per_m));
        let radius = self.radius as f32 * units_per_m;
        [begin.x, begin.y, begin.z, radius, end.x, end.y, end.z, 0.0]
    }
}

/// Capsules around everything solid that is seen of a tick, at most [`MAX_CAPSULES`]; objects come first.
///
/// Units: `shape` m, object frame. Frame of the capsules: world, m.
pub fn capsules(frame: &ViewFrame, shape: &[Point3<f64>], hand_is_shown: bool) -> Vec<Capsule> {
    let mut all: Vec<_> = around(&frame.object.world_from_object, shape).into_iter().collect();
    for other in &frame.others {
        all.extend(around(&other.world_from_object, &other.shape()));
    }
    if hand_is_shown {
        all.extend(frame.hands().flat_map(of_hand));
    }
    all.truncate(MAX_CAPSULES);
    all
}

/// The capsule along the longest extent of some points; `None` for no points.
fn around(world_from_object: &Isometry3<f64>, shape: &[Point3<f64>]) -> Option<Capsule> {
    let first = shape.first()?;
    let (mut low, mut high) = (*first, *first);
    for point in shape {
        (low, high) = (low.inf(point), high.sup(point));
    }
    let half = (high - low) * 0.5;
    let longest = half.imax();
    let radius = 0.5 * (half.sum() - half[longest]);
    let mut along = Vector3::zeros();
    along[longest] = (half[longest] - radius).max(0.0);
    let centre = nalgebra::center(&low, &high);
    let (begin, end) = (world_from_object * (centre - along), world_from_object * (centre + along));
    Some(Capsule { begin, end, radius })
}

/// Capsules of the palm, and of each finger in two straight pieces.
fn of_hand(hand: &HandView) -> impl Iterator<Item = Capsule> {
    let fingers = hand.colliders().fingers;
    let knuckles = nalgebra::center(&fingers[1].cylinders[0].base, &fingers[4].cylinders[0].base);
    let wrist = Point3::from(hand.world_from_palm.translation.vector);
    let palm = Capsule { begin: wrist, end: knuckles, radius: PALM_RADIUS_M };
    let pieces = fingers.into_iter().flat_map(|finger| {
        let [near, middle, far] = finger.cylinders;
        let piece = |begin, end, radius| Capsule { begin, end, radius };
        [
            piece(near.base, middle.base, near.radius),
            piece(middle.base, finger.tip.centre, far.radius),
        ]
    });
    std::iter::once(palm).chain(pieces)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn long_box_becomes_a_capsule_along_it_and_a_cube_a_sphere() {
        let corners = |x: f64| [Point3::new(-x, -1.0, -1.0), Point3::new(x, 1.0, 1.0)];
        let lifted = Isometry3::translation(0.0, 2.0, 0.0);
        let long = around(&lifted, &corners(4.0)).expect("there are points");
        assert_eq!(long.radius, 1.0);
        assert_eq!(
            (long.begin, long.end),
            (Point3::new(-3.0, 2.0, 0.0), Point3::new(3.0, 2.0, 0.0))
        );
        let cube = around(&lifted, &corners(1.0)).expect("there are points");
        assert_eq!(
            (cube.begin, cube.end),
            (Point3::new(0.0, 2.0, 0.0), Point3::new(0.0, 2.0, 0.0))
        );
        assert!(around(&lifted, &[]).is_none());
    }
}
