//! A rigid body that moves on a given way while the object answers.

use nalgebra::{Isometry3, Vector3};

use crate::rigid_body::RigidShape;

/// A rigid body, where it is when the step begins and when it ends.
#[derive(Clone, Debug)]
pub struct MovingBody {
    /// Its shape.
    pub shape: RigidShape,
    /// Pose at the beginning of the step.
    pub world_from_body_start: Isometry3<f64>,
    /// Pose at its end.
    pub world_from_body_end: Isometry3<f64>,
    /// Coefficient of friction between the body and the object, at least 0.
    pub friction: f64,
    /// How far the body gives way to a force on it, m/N; 0 for one that keeps to its poses. A finger
    /// that is measured inside the object presses by how far it is pushed back.
    pub compliance: f64,
}

impl MovingBody {
    /// A body that rests.
    pub fn resting(shape: RigidShape, world_from_body: Isometry3<f64>, friction: f64) -> Self {
        let (start, end) = (world_from_body, world_from_body);
        Self {
            shape,
            world_from_body_start: start,
            world_from_body_end: end,
            friction,
            compliance: 0.0,
        }
    }

    /// Pose at the end once the object has pushed it back by a force, N, world: that of the body on the
    /// object.
    pub fn pushed_back(&self, pose: &Isometry3<f64>, force: &Vector3<f64>) -> Isometry3<f64> {
        let mut pushed = *pose;
        pushed.translation.vector -= self.compliance * force;
        pushed
    }

    /// The part of the way between two shares of it, turned and moved evenly.
    pub fn part(&self, from: f64, to: f64) -> Self {
        let at = |share: f64| {
            let (start, end) = (&self.world_from_body_start, &self.world_from_body_end);
            match share {
                0.0 => *start,
                1.0 => *end,
                _ => {
                    let turn = start.rotation.rotation_to(&end.rotation).powf(share);
                    let place = start.translation.vector.lerp(&end.translation.vector, share);
                    Isometry3::from_parts(place.into(), turn * start.rotation)
                }
            }
        };
        Self {
            shape: self.shape.clone(),
            world_from_body_start: at(from),
            world_from_body_end: at(to),
            friction: self.friction,
            compliance: self.compliance,
        }
    }

    /// Bound on how far a point of the body goes, m; for a half space the points near its origin count.
    pub fn way(&self) -> f64 {
        self.way_between(&Isometry3::identity(), &Isometry3::identity())
    }

    /// Longest way of a point of the body, seen from a frame that moves too, from one pose in the world to
    /// another.
    pub fn way_between(&self, before: &Isometry3<f64>, after: &Isometry3<f64>) -> f64 {
        let start = before.inverse() * self.world_from_body_start;
        let end = after.inverse() * self.world_from_body_end;
        let reach = self.shape.reach();
        let reach = if reach.is_finite() { reach } else { 0.0 };
        let turn = start.rotation.angle_to(&end.rotation);
        (end.translation.vector - start.translation.vector).norm() + turn * reach
    }
}
