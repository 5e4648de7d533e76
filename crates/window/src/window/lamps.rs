//! The lamps of the stage and the wall behind it, as the renderer takes them.

use kiss3d::prelude::{Color, Light, Vec3};

use crate::view::light::{self, Lamp};

/// A lamp for the renderer.
pub fn light(lamp: &Lamp) -> Light {
    let [red, green, blue] = lamp.colour;
    let colour = Color::new(red, green, blue, 1.0);
    let direction = Vec3::from_array(lamp.direction);
    Light::directional(direction).with_color(colour).with_intensity(lamp.strength)
}

/// Colour of the wall behind everything.
pub fn wall() -> Color {
    let [red, green, blue] = light::wall();
    Color::new(red, green, blue, 1.0)
}
