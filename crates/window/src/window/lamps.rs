//! The lamps of the stage and the wall behind it: the same for every level of drawing.

use kiss3d::prelude::{Color, Light, Vec3};

use super::environment::HORIZON;

/// A lamp far away.
pub struct Lamp {
    /// Where its light goes, in the world; of any length.
    pub direction: Vec3,
    /// Linear.
    pub colour: [f32; 3],
    /// How bright a white surface below it gets, times π.
    pub strength: f32,
}

impl Lamp {
    /// As the renderer takes it.
    pub fn light(&self) -> Light {
        let [red, green, blue] = self.colour;
        let colour = Color::new(red, green, blue, 1.0);
        Light::directional(self.direction).with_color(colour).with_intensity(self.strength)
    }
}

/// The lamp that makes the shadows, from above.
pub const KEY: Lamp =
    Lamp { direction: Vec3::new(-0.35, -1.0, -0.45), colour: [1.0, 0.97, 0.92], strength: 1.7 };
/// Makes the other side lighter.
pub const FILL: Lamp =
    Lamp { direction: Vec3::new(0.7, -0.35, 0.25), colour: [0.80, 0.88, 1.0], strength: 0.35 };
/// Distances from the eye at which things begin to vanish before the wall, and are gone, m.
pub const FOG_M: [f32; 2] = [0.8, 2.6];
/// Strength of the light from all around.
pub const SKY: f32 = 0.85;

/// Colour of the wall behind everything.
pub fn wall() -> Color {
    let [red, green, blue] = HORIZON.map(|c| c * SKY);
    Color::new(red, green, blue, 1.0)
}
