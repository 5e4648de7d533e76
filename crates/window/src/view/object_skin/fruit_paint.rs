//! The skin of a strawberry: red, paler towards the stalk, with a dimple around each seed.

use nalgebra::{Point3, Vector3};

use super::bake::Paint;
use crate::view::blend::{mix, smooth_step};

/// Colours and dimples of one fruit.
pub(super) struct FruitPaint {
    /// Seeds in ascending order of height. Units: m.
    seeds: Vec<Vector3<f64>>,
    low: f64,
    high: f64,
    scale: f64,
}

impl FruitPaint {
    /// Skin between two heights, with dimples at the seeds.
    ///
    /// Units: m; `scale` is the fruit's height by that of a usual one.
    pub(super) fn new(mut seeds: Vec<Vector3<f64>>, low: f64, high: f64, scale: f64) -> Self {
        seeds.sort_by(|a, b| a.y.total_cmp(&b.y));
        Self { seeds, low, high, scale }
    }

    /// What a place of the skin looks like.
    pub(super) fn at(&self, p: &Point3<f64>) -> Paint {
        let height = (p.y - self.low) / (self.high - self.low);
        let cloud = clouds(&(p.coords / self.scale));
        // Ripe below, paler in a ring below the leaves, palest in the dent.
        let pale = smooth_step(0.0, 1.0, (height + 0.03 * cloud - 0.90) / 0.14);
        let mut colour = mix(RIPE, BRIGHT, 0.5 + 0.5 * cloud);
        colour = mix(colour, PALE, 0.7 * pale);
        let (shade, slope) = self.dimples(&p.coords);
        Paint { colour: mix(colour, DIMPLE, shade), slope }
    }

    /// Shade and slope of the dimples around a place.
    fn dimples(&self, p: &Vector3<f64>) -> (f64, Vector3<f64>) {
        let reach = 2.4 * DIMPLE_RADIUS * self.scale;
        let first = self.seeds.partition_point(|s| s.y < p.y - reach);
        let near = self.seeds[first..].iter().take_while(|s| s.y <= p.y + reach);
        let mut slope = Vector3::zeros();
        let mut shade = 0.0;
        for seed in near {
            let away = (p - seed) / self.scale;
            let square = away.norm_squared() / (DIMPLE_RADIUS * DIMPLE_RADIUS);
            if square < 6.0 {
                let depth = (-square).exp();
                // Height is −depth, its gradient points away from the seed.
                slope += away * (2.0 * DIMPLE_DEPTH * depth / (DIMPLE_RADIUS * DIMPLE_RADIUS));
                shade += 0.62 * (-1.6 * square).exp();
            }
        }
        (shade.min(0.75), slope)
    }
}

/// Slow change over the skin, −1 to 1, from waves that do not repeat in sight. Units: m.
fn clouds(p: &Vector3<f64>) -> f64 {
    let wave = |x: f64, y: f64, z: f64, phase: f64| (p.x * x + p.y * y + p.z * z + phase).sin();
    0.4 * wave(150.0, 90.0, -120.0, 0.3)
        + 0.35 * wave(-210.0, 160.0, 70.0, 1.7)
        + 0.25 * wave(90.0, -310.0, 260.0, 4.0)
}

const RIPE: [f64; 3] = [0.74, 0.03, 0.05];
const BRIGHT: [f64; 3] = [0.86, 0.07, 0.07];
const PALE: [f64; 3] = [0.95, 0.52, 0.36];
const DIMPLE: [f64; 3] = [0.42, 0.005, 0.02];
/// Distance from a seed at which a dimple has lost most of its depth, m.
const DIMPLE_RADIUS: f64 = 0.0019;
const DIMPLE_DEPTH: f64 = 0.0008;
