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
    /// The object's centre, seen from the palm.
    pub object_in_palm: Vector3<f64>,
}

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

    /// The same hand, further back: the object is moved out of the palm's side (−Z) by `distance`.
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

    /// Direction the palm looks in the world.
    pub fn gaze(&self) -> Vector3<f64> {
        self.world_from_palm_rotation * -Vector3::z()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

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
