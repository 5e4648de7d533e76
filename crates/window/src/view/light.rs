//! The light of the stage, in plain numbers: what the window and the page for browsers draw by.

/// A lamp far away.
pub struct Lamp {
    /// Direction in which the light goes, in the world; of any length.
    pub direction: [f32; 3],
    /// Colour of the light, linear.
    pub colour: [f32; 3],
    /// Brightness of a white surface below the lamp, times π.
    pub strength: f32,
}

/// The lamp that makes the shadows, from above.
pub const KEY: Lamp =
    Lamp { direction: [-0.35, -1.0, -0.45], colour: [1.0, 0.97, 0.92], strength: 1.7 };
/// The lamp that brightens the side in the shadow.
pub const FILL: Lamp =
    Lamp { direction: [0.7, -0.35, 0.25], colour: [0.80, 0.88, 1.0], strength: 0.35 };
/// Distances from the eye at which things begin to vanish before the wall, and are gone, m.
pub const FOG_M: [f32; 2] = [0.8, 2.6];
/// Strength of the light from all around.
pub const SKY: f32 = 0.85;
/// Colour of the surroundings at the height of the eye, linear.
pub const HORIZON: [f32; 3] = [0.78, 0.80, 0.83];
/// Light that gets around the edge of every body, so that no side is black.
pub const WRAP: f32 = 0.25;
/// Colour of the ground, linear.
pub const GROUND: [f32; 3] = [0.66, 0.68, 0.71];
/// Roughness of the ground, 0 to 1.
pub const GROUND_ROUGHNESS: f32 = 0.85;
/// Height of the ground, y of the world, m, where there is no table: so far below the object's home.
pub const GROUND_M: f64 = -0.085;
/// How a hand's skin takes the light: roughness, and share of the light that comes through from behind.
pub const HAND: [f32; 2] = [0.55, 0.25];

/// Colour of the wall behind everything, linear.
pub fn wall() -> [f32; 3] {
    HORIZON.map(|c| c * SKY)
}

impl Lamp {
    /// Light that a white surface straight below the lamp throws back, linear.
    pub fn thrown(&self) -> [f32; 3] {
        self.colour.map(|c| c * self.strength * std::f32::consts::FRAC_1_PI)
    }
}
