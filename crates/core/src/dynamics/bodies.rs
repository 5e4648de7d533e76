//! A rigid body that moves on a given way while the object answers.

use nalgebra::{Isometry3, Point3};

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
}

impl MovingBody {
    /// A body that rests.
    pub fn resting(shape: RigidShape, world_from_body: Isometry3<f64>, friction: f64) -> Self {
        let (start, end) = (world_from_body, world_from_body);
        Self { shape, world_from_body_start: start, world_from_body_end: end, friction }
    }

    /// Where a point that sticks to the body at the beginning is at the end.
    ///
    /// Frame: world.
    pub fn carried(&self, point_in_world: &Point3<f64>) -> Point3<f64> {
        self.world_from_body_end
            * self.world_from_body_start.inverse_transform_point(point_in_world)
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
        }
    }

    /// Bound on how far a point of the body goes, m; for a half space the points near its origin count.
    pub fn way(&self) -> f64 {
        let (start, end) = (&self.world_from_body_start, &self.world_from_body_end);
        let reach = self.shape.reach();
        let reach = if reach.is_finite() { reach } else { 0.0 };
        let turn = start.rotation.angle_to(&end.rotation);
        (end.translation.vector - start.translation.vector).norm() + turn * reach
    }
}
