//! The stage on which the scene stands: light, ground, shadow, and how much of it is drawn.

use std::rc::Rc;

use kiss3d::post_processing::Tonemap;
use kiss3d::prelude::{
    Color, Fog, NumSamples, OrbitCamera3d, Projection, SceneNode3d, Vec3, Window,
};

use super::environment::studio;
use super::environment::{light, wall};
use super::plain_material::{PlainMaterial, SharedCapsules, SharedMaterial};
use super::units::{UNITS_PER_M, drawn_point};
use crate::view::camera::{FIELD_OF_VIEW, ViewCamera};
use crate::view::display::Level;
use crate::view::ground_shade::Capsule;
use crate::view::light::{FILL, FOG_M, GROUND, GROUND_M, GROUND_ROUGHNESS, HORIZON, KEY, SKY};

/// Lights and ground of the scene.
pub struct Stage {
    ground: SceneNode3d,
    /// Height of the ground, y of the world, m.
    ground_m: f64,
    level: Option<Level>,
    plain: SharedMaterial,
    plain_ground: SharedMaterial,
    /// Capsules that darken the ground at the plain level.
    capsules: SharedCapsules,
}

/// Radius of the ground, m: far beyond what is seen sharply.
const GROUND_RADIUS_M: f32 = 3.0;
/// Number of shadow cascades of the key light, the only one that casts shadows; the renderer would keep
/// room for sixteen.
const KEY_CASCADES: u32 = 4;

impl Stage {
    /// Sets up lights and ground.
    pub fn new(window: &mut Window, scene: &mut SceneNode3d) -> Self {
        window.set_skybox_image(&studio());
        window.set_skybox_orientation(0.0, SKY);
        window.set_background_color(Color::new(HORIZON[0], HORIZON[1], HORIZON[2], 1.0));
        let [fog_begin, fog_end] = FOG_M.map(|m| m * UNITS_PER_M);
        window.set_fog(Fog::linear(wall(), fog_begin, fog_end));
        window.hdr_settings_mut().tonemap = Tonemap::Neutral;
        scene.add_light(light(&KEY));
        scene.add_light(light(&FILL).with_casts_shadows(false));
        let radius = GROUND_RADIUS_M * UNITS_PER_M;
        let mut ground = scene.add_cylinder(radius, 0.2);
        let below = drawn_point(&nalgebra::Point3::new(0.0, GROUND_M, 0.0));
        ground.set_position(below - Vec3::Y * 0.1);
        let [red, green, blue] = GROUND;
        ground.set_color(Color::new(red, green, blue, 1.0));
        ground.set_roughness(GROUND_ROUGHNESS).set_metallic(0.0);
        let (plain, capsules) = (PlainMaterial::of_bodies(), SharedCapsules::default());
        let plain_ground = PlainMaterial::of_ground(Rc::clone(&capsules));
        Self { ground, ground_m: GROUND_M, level: None, plain, plain_ground, capsules }
    }

    /// Puts the ground at a height: the table that an object lies on, or [`GROUND_M`].
    ///
    /// Units: m. Frame: y of the world.
    pub fn set_ground(&mut self, height: f64) {
        if self.ground_m != height {
            self.ground_m = height;
            let top = drawn_point(&nalgebra::Point3::new(0.0, height, 0.0));
            self.ground.set_position(top - Vec3::Y * 0.1);
        }
    }

    /// Sets the level of the light; returns whether it is another one than before.
    pub fn set_level(&mut self, window: &mut Window, level: Level) -> bool {
        if self.level == Some(level) {
            return false;
        }
        self.level = Some(level);
        window.set_shadows_enabled(level != Level::Plain);
        window.set_shadow_distance(0.9 * UNITS_PER_M);
        window.set_shadow_atlas_layers(KEY_CASCADES);
        window.set_shadow_resolution(match level {
            Level::Plain => 64,
            Level::Fair => 2048,
            Level::Full => 4096,
        });
        window.set_shadow_softness(if level == Level::Full { 2.5 } else { 1.5 });
        window.set_ssao_enabled(level == Level::Full);
        window.set_samples(if level == Level::Plain { NumSamples::One } else { NumSamples::Four });
        self.ground.set_visible(true);
        true
    }

    /// Gives everything below the root the material of the level.
    pub fn dress(&mut self, root: &mut SceneNode3d) {
        if self.level == Some(Level::Plain) {
            root.set_material_recursive(Rc::clone(&self.plain));
            self.ground.set_material(Rc::clone(&self.plain_ground));
        } else {
            root.set_material_with_name_recursive("object");
        }
    }

    /// Sets the capsules below which the ground is darker, at the plain level.
    pub fn shade_ground(&mut self, capsules: Vec<Capsule>) {
        self.capsules.replace(capsules);
    }
}

/// The renderer's camera; none of its own ways to move it are used.
pub fn drawn_camera() -> OrbitCamera3d {
    let (near, far) = (0.01 * UNITS_PER_M, 12.0 * UNITS_PER_M);
    let mut camera = OrbitCamera3d::new_with_frustum(
        FIELD_OF_VIEW as f32,
        near,
        far,
        Vec3::new(0.0, 0.0, 1.0),
        Vec3::ZERO,
    );
    camera.rebind_rotate_button(None);
    camera.rebind_drag_button(None);
    camera.rebind_reset_key(None);
    camera.set_dist_step(1.0);
    camera.set_projection(Projection::Perspective);
    camera
}

/// Puts the renderer's camera where the viewer's eye is.
pub fn place_camera(drawn: &mut OrbitCamera3d, view: &ViewCamera) {
    drawn.look_at(drawn_point(&view.eye()), drawn_point(&view.target));
}
