//! The light around the scene: a photographer's studio, painted by formula.

use image::{DynamicImage, ImageBuffer, Rgb, Rgb32FImage};
use kiss3d::prelude::{Color, Light, Vec3};

use crate::view::blend::smooth_step;
use crate::view::light;
use crate::view::light::{HORIZON, Lamp};

/// Width of the picture of the surroundings, texels; its height is half of it.
const WIDTH: u32 = 256;

/// Surroundings as an equirectangular picture in linear light: a bright room whose wall meets the
/// ground without an edge, a large soft lamp above, a strip at each side.
pub fn studio() -> DynamicImage {
    let height = WIDTH / 2;
    let picture: Rgb32FImage = ImageBuffer::from_fn(WIDTH, height, |x, y| {
        let azimuth = (f64::from(x) + 0.5) / f64::from(WIDTH) * std::f64::consts::TAU;
        let elevation = (0.5 - (f64::from(y) + 0.5) / f64::from(height)) * std::f64::consts::PI;
        Rgb(radiance(azimuth, elevation))
    });
    DynamicImage::ImageRgb32F(picture)
}

fn radiance(azimuth: f64, elevation: f64) -> [f32; 3] {
    let up = elevation.sin();
    // The wall grows darker upward, the ground stays as it is.
    let shade = if up > 0.0 { 1.0 - 0.62 * up.powf(0.8) } else { 1.0 + 0.5 * up };
    let above = smooth_step(0.66, 0.86, up);
    // Lamps at the sides hang high, where no wall behind the scene is seen.
    let side = |centre: f64| {
        let off = (azimuth - centre).cos();
        smooth_step(0.90, 0.97, off)
            * smooth_step(0.30, 0.42, up)
            * (1.0 - smooth_step(0.58, 0.68, up))
    };
    let lamp = 2.4 * above + 2.6 * side(0.6) + 1.4 * side(3.9);
    std::array::from_fn(|i| HORIZON[i] * shade as f32 + lamp as f32)
}

/// The renderer's light for a lamp.
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn studio_is_bright_everywhere_and_the_lamp_above_outshines_the_wall() {
        for step in 0..64 {
            let azimuth = f64::from(step) * 0.1;
            let above = radiance(azimuth, 1.4);
            for elevation in [-1.5, -0.3, 0.0, 0.2] {
                let here = radiance(azimuth, elevation);
                assert!(here.iter().all(|c| c.is_finite() && *c > 0.2));
                assert!(above[1] > here[1]);
            }
        }
    }

    #[test]
    fn surroundings_close_without_a_seam() {
        for elevation in [-1.0, 0.0, 0.5, 1.2] {
            let (a, b) =
                (radiance(1e-9, elevation), radiance(std::f64::consts::TAU - 1e-9, elevation));
            assert!(a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-3));
        }
    }
}
