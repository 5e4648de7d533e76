//! From metres to the units that are drawn.

use kiss3d::prelude::{Pose3, Quat, Vec3};
use nalgebra::{Isometry3, Point3, Vector3};

/// Drawn units per metre. The renderer's shadows and near plane are made for scenes of a few units;
/// a hand is 0.2 m long.
pub const UNITS_PER_M: f32 = 20.0;

/// A point of the world as it is drawn.
pub fn drawn_point(world: &Point3<f64>) -> Vec3 {
    drawn_vector(&world.coords)
}

/// A vector of the world as it is drawn.
pub fn drawn_vector(world: &Vector3<f64>) -> Vec3 {
    Vec3::new(world.x as f32, world.y as f32, world.z as f32) * UNITS_PER_M
}

/// A pose in the world as it is drawn.
pub fn drawn_pose(world: &Isometry3<f64>) -> Pose3 {
    let q = &world.rotation;
    Pose3::from_parts(
        drawn_vector(&world.translation.vector),
        Quat::from_xyzw(q.i as f32, q.j as f32, q.k as f32, q.w as f32),
    )
}

/// The rotation that turns +Y, along which the renderer's cylinders lie, to a direction.
pub fn rotation_from_y(direction: &Vector3<f64>) -> Quat {
    let d = Vec3::new(direction.x as f32, direction.y as f32, direction.z as f32);
    d.try_normalize().map_or(Quat::IDENTITY, |d| Quat::from_rotation_arc(Vec3::Y, d))
}
