//! Rigid bodies that move on given ways while the object answers, and which triangles they can touch: how
//! near these must be, and a search that looks at all of them, the oracle of every quicker one.

use nalgebra::{Isometry3, Point3, Vector3};

use super::features::{Candidate, Triangle};
use crate::rigid_body::RigidShape;

/// A rigid body, where it is when the step begins and when it ends.
#[derive(Clone, Debug)]
pub struct MovingBody {
    /// Shape of the body, in the body's frame.
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

/// What lies farther from a body than this share of the object's size is never asked about.
const MARGIN_OF_SIZE: f64 = 0.02;

/// How near a triangle must be to be able to touch: what bodies and object move in the step, and a share
/// of the object's extent for what the surface moves.
///
/// Units: m, s; `speed` of the object's middle in the step at most m/s, `turning` rad/s.
pub fn reach_of_step(
    extent: f64,
    bodies: &[MovingBody],
    seconds: f64,
    (speed, turning): (f64, f64),
) -> f64 {
    let way = bodies.iter().map(MovingBody::way).fold(0.0, f64::max);
    2.0 * way + 2.0 * seconds * (speed + turning * extent) + MARGIN_OF_SIZE * extent
}

/// Triangles whose distance from a body at the end of the step can be below a margin.
///
/// Shapes: `places` one point for each node, in the object's frame; `triangles` of them; result
/// ascending. Units: m.
pub fn near_triangles(
    places: &[Point3<f64>],
    triangles: &[[u32; 3]],
    world_from_object: &Isometry3<f64>,
    bodies: &[MovingBody],
    margin: f64,
) -> Vec<Candidate> {
    let object_from_world = world_from_object.inverse();
    let poses: Vec<Isometry3<f64>> =
        bodies.iter().map(|body| object_from_world * body.world_from_body_end).collect();
    let mut near = Vec::new();
    for (triangle, nodes) in (0u32..).zip(triangles) {
        let of_surface = Triangle::new(nodes.map(|node| places[node as usize]));
        for ((position, body), pose) in (0u16..).zip(bodies).zip(&poses) {
            if of_surface.is_within(&body.shape, pose, margin) {
                near.push(Candidate { triangle, body: position });
            }
        }
    }
    near
}
