//! The spheres of the sphere tree as they are drawn.

use kiss3d::prelude::{Color, InstanceData3d, Mat3, SceneNode3d, Vec3};
use nalgebra::Isometry3;
use softgrasp_grasp::shape::Sphere;

use super::units::{UNITS_PER_M, drawn_pose};

/// Spheres to be seen through, in two colours.
pub struct DrawnSpheres {
    node: SceneNode3d,
}

/// Spheres that are passed by.
pub const PASSED: Color = Color::new(0.16, 0.36, 0.80, 0.26);
/// Spheres that are looked into.
pub const ENTERED: Color = Color::new(0.95, 0.45, 0.10, 0.30);

impl DrawnSpheres {
    /// None yet.
    pub fn new(scene: &mut SceneNode3d) -> Self {
        let mut node = scene.add_sphere_with_subdiv(1.0, 24, 16);
        node.set_roughness(0.6).set_casts_shadows(false);
        node.set_color(Color::new(1.0, 1.0, 1.0, 0.99));
        node.set_visible(false);
        Self { node }
    }

    /// Keeps the renderer's own material, which draws many at once, whatever the rest has.
    pub fn keep_material(&mut self) {
        self.node.set_material_with_name("object");
    }

    /// Shows these.
    ///
    /// Units: m. Frame: the object's.
    pub fn show(&mut self, world_from_object: &Isometry3<f64>, spheres: &[(Sphere, Color)]) {
        self.node.set_visible(!spheres.is_empty());
        if spheres.is_empty() {
            return;
        }
        self.node.set_pose(drawn_pose(world_from_object));
        let instances: Vec<_> = spheres
            .iter()
            .map(|(sphere, color)| {
                let c = sphere.centre;
                InstanceData3d {
                    position: Vec3::new(c.x as f32, c.y as f32, c.z as f32) * UNITS_PER_M,
                    deformation: Mat3::from_diagonal(Vec3::splat(
                        sphere.radius as f32 * UNITS_PER_M,
                    )),
                    color: *color,
                    ..InstanceData3d::default()
                }
            })
            .collect();
        self.node.set_instances(&instances);
    }
}
