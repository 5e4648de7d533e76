//! The path of the palm while the scripted hand reaches; the palm always faces the object.

use nalgebra::{Isometry3, Point3, Translation3, UnitQuaternion, Vector3};

/// A palm pose told by how the hand sees the object.
///
/// Units: m. Frames: `world_from_palm_rotation` as named; `object_in_palm` is the object's centre in
/// the palm frame (`docs/frames.md`).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PalmPath {
    /// Orientation of the palm in the world.
    pub world_from_palm_rotation: UnitQuaternion<f64>,
    /// Centre of the object, seen from the palm.
    pub object_in_palm: Vector3<f64>,
}

/// How far the hand keeps away while it is not grasping, m.
pub(super) const BACK_OFF: f64 = 0.22;

impl PalmPath {
    /// Palm pose for an object centred at a point of the world.
    pub fn world_from_palm(&self, object_in_world: Point3<f64>) -> Isometry3<f64> {
        Isometry3::from_parts(
            Translation3::from(
                object_in_world.coords - self.world_from_palm_rotation * self.object_in_palm,
            ),
            self.world_from_palm_rotation,
        )
    }

    /// This path, further back: the object is moved out of the palm's side (−Z) by `distance`.
    #[must_use]
    pub fn backed_off(&self, distance: f64) -> Self {
        let object_in_palm = self.object_in_palm - Vector3::new(0.0, 0.0, distance);
        Self { object_in_palm, ..*self }
    }

    /// Part of the way to another path: the hand turns around the object without coming nearer
    /// than the ends are.
    #[must_use]
    pub fn toward(&self, other: &Self, share: f64) -> Self {
        let rotation = self
            .world_from_palm_rotation
            .try_slerp(&other.world_from_palm_rotation, share, 1e-9)
            // Half a turn has no shortest way; then the turn happens at once, far from the object.
            .unwrap_or(other.world_from_palm_rotation);
        Self {
            world_from_palm_rotation: rotation,
            object_in_palm: self.object_in_palm.lerp(&other.object_in_palm, share),
        }
    }

    /// Unit direction in the world in which the palm looks.
    pub fn gaze(&self) -> Vector3<f64> {
        self.world_from_palm_rotation * -Vector3::z()
    }
}

/// The ground on which the window shows the scene, m, world: so far below the object's home.
const GROUND_M: f64 = -0.085;
/// What of the hand comes near the ground, in the palm's frame, m: fingertips, knuckles, wrist, and
/// the end of the sleeve, and how thick the hand is there.
const LOWEST: [([f64; 3], f64); 7] = [
    ([0.0, 0.185, 0.0], 0.012),
    ([-0.09, 0.08, 0.0], 0.014),
    ([0.045, 0.15, 0.0], 0.012),
    ([0.04, 0.085, 0.0], 0.018),
    ([-0.04, 0.085, 0.0], 0.018),
    ([0.0, 0.0, 0.0], 0.034),
    ([0.0, -0.075, 0.0], 0.046),
];
/// The hand goes down to where it grasps in so large a part of its way.
const DESCENT: f64 = 0.5;

/// A palm that is raised so far that hand and sleeve stay above the ground; `away` is 0 where the
/// hand grasps, which leaves the palm as it is, and 1 at the other end of its way.
///
/// Frame: world, Y up.
pub(super) fn above_ground(world_from_palm: &Isometry3<f64>, away: f64) -> Isometry3<f64> {
    let lowest =
        LOWEST.iter().map(|(place, radius)| (world_from_palm * Point3::from(*place)).y - radius);
    let missing = GROUND_M - lowest.fold(f64::INFINITY, f64::min);
    let raised = missing.max(0.0) * (away / DESCENT).min(1.0);
    Translation3::new(0.0, raised, 0.0) * world_from_palm
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn hand_that_comes_from_below_goes_over_the_ground_and_not_through_it() {
        let palm = Isometry3::new(Vector3::new(0.0, -0.06, 0.05), Vector3::new(-0.9, 0.0, 0.0));
        let lowest = |palm: &Isometry3<f64>| {
            let ys = LOWEST.iter().map(|(place, radius)| (palm * Point3::from(*place)).y - radius);
            ys.fold(f64::INFINITY, f64::min)
        };
        assert!(lowest(&palm) < GROUND_M - 0.01, "it would go through the ground");
        for away in [1.0, 0.7, DESCENT] {
            assert!(lowest(&above_ground(&palm, away)) >= GROUND_M - 1e-12);
        }
        assert_eq!(above_ground(&palm, 0.0), palm, "where it grasps it is where it was planned");
        let high = Isometry3::translation(0.0, 0.3, 0.0);
        assert_eq!(above_ground(&high, 1.0), high);
    }

    #[test]
    fn object_stays_where_the_palm_sees_it() {
        let path = PalmPath {
            world_from_palm_rotation: UnitQuaternion::from_euler_angles(0.3, -1.0, 2.0),
            object_in_palm: Vector3::new(0.01, 0.12, -0.05),
        };
        let centre = Point3::new(0.2, -0.1, 0.4);
        let seen = path.world_from_palm(centre).inverse() * centre;
        assert!((seen.coords - path.object_in_palm).norm() < 1e-15);
        let back = path.backed_off(0.1).world_from_palm(centre);
        let moved = back.translation.vector - path.world_from_palm(centre).translation.vector;
        assert!((moved + path.gaze() * 0.1).norm() < 1e-15);
    }
}
