//! The skins that are painted by formula: the strawberry, the toys, the print on the toothpaste tube.

use std::f64::consts::{FRAC_PI_2, TAU};

use nalgebra::{Point3, Vector3};

use super::bake::Paint;
use super::lettering::{distance_to_word, word_width};
use super::tube_profile::{TubePlace, TubeProfile};
use crate::view::blend::{mix, smooth_step};
use crate::view::texture::Texture;

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

/// A ball about a centre: segments in two colours, a round cap at each end. Units: m.
pub(super) fn ball(centre: &Point3<f64>, p: &Point3<f64>) -> Paint {
    // The poles lean towards the viewer, so that they are seen.
    let ray = (p - centre).normalize();
    let axis = Vector3::new(0.28, 0.86, 0.42).normalize();
    let side = axis.cross(&Vector3::x()).normalize();
    let other = axis.cross(&side);
    let up = ray.dot(&axis);
    let across = (1.0 - up * up).max(1e-9).sqrt();
    let angle = ray.dot(&side).atan2(ray.dot(&other));
    // Positive in the coloured segments; by the factor a length on the unit ball.
    let turn = (angle / TAU * SEGMENTS).rem_euclid(2.0) - 1.0;
    let in_segment = (0.5 - (turn.abs() - 0.5).abs()) * turn.signum() * across * TAU / SEGMENTS;
    let in_cap = across - CAP;
    let edge = |length: f64| smooth_step(0.0, 1.0, 0.5 + length / BLUR);
    let colour = mix(CREAM, TEAL, edge(in_segment));
    let colour = mix(CORAL, colour, edge(in_cap));
    // A fine groove where two colours meet.
    let groove = (-(in_segment / 0.018).powi(2)).exp().min(edge(in_cap));
    Paint { colour: mix(colour, SEAM, 0.35 * groove), slope: Vector3::zeros() }
}

/// One face of the foam block: a grid, finer lines between stronger ones.
pub(super) fn foam() -> Texture {
    Texture::painted(1024, 1024, |u, v| {
        let line = |x: f64, count: f64, half: f64| {
            let from_line = ((x * count + 0.5).fract() - 0.5).abs() / count;
            smooth_step(0.0, 1.0, 0.5 + (half - from_line) / 0.0022)
        };
        let strong = line(u, 4.0, 0.0042).max(line(v, 4.0, 0.0042));
        let fine = line(u, 16.0, 0.0016).max(line(v, 16.0, 0.0016));
        // Foam is not quite even.
        let speck = (u * 611.0 + 3.0 * (v * 397.0).sin()).sin() * (v * 533.0).sin();
        let base = mix(YELLOW, YELLOW_DEEP, 0.5 + 0.5 * speck);
        mix(mix(base, LINE_FINE, 0.55 * fine), LINE, 0.85 * strong)
    })
}

/// Coloured and white segments together.
const SEGMENTS: f64 = 8.0;
/// Sine of the angle that a cap reaches from its pole.
const CAP: f64 = 0.24;
/// Width over which edges fade, on the unit ball.
const BLUR: f64 = 0.008;
const TEAL: [f64; 3] = [0.05, 0.58, 0.62];
const CREAM: [f64; 3] = [0.96, 0.94, 0.88];
const CORAL: [f64; 3] = [0.96, 0.45, 0.34];
const SEAM: [f64; 3] = [0.25, 0.38, 0.40];
const YELLOW: [f64; 3] = [0.98, 0.76, 0.24];
const YELLOW_DEEP: [f64; 3] = [0.96, 0.73, 0.21];
const LINE: [f64; 3] = [0.78, 0.46, 0.08];
const LINE_FINE: [f64; 3] = [0.88, 0.60, 0.14];

/// The print of one tube, the same on its front and on its back.
pub(super) struct TubePaint {
    profile: TubeProfile,
    word_width: f64,
}

impl TubePaint {
    /// Print for a tube along X, nozzle at −X.
    pub(super) fn new(profile: TubeProfile) -> Self {
        Self { profile, word_width: word_width(NAME) }
    }

    /// What a place of the tube looks like.
    pub(super) fn at(&self, p: &Point3<f64>) -> Paint {
        let TubePlace { along, quarters, half_extents } = self.profile.place(p);
        // From the middle of the front or of the back, upward as one reads it.
        let is_back = quarters >= 2.0;
        let from_middle = if is_back { 3.0 - quarters } else { quarters - 1.0 };
        let length = self.profile.high - self.profile.low;
        let [height, width] = half_extents;
        let up = from_middle * FRAC_PI_2 * height.hypot(width) / 2f64.sqrt() / length;
        // On the back one reads with the nozzle to the right.
        let reading = if is_back { 1.0 - along } else { along };
        let mut colour = mix(WHITE, MINT, smooth_step(0.0, 1.0, (along - 0.80) / 0.12));
        colour = mix(colour, MINT, smooth_step(0.0, 1.0, (0.155 - along) / 0.03));
        colour = swoosh(colour, along, up);
        let word = [
            (reading - 0.5 - if is_back { -WORD_MIDDLE } else { WORD_MIDDLE }) / LETTER_HEIGHT
                + self.word_width / 2.0,
            up / LETTER_HEIGHT + WORD_BASE,
        ];
        let pen = distance_to_word(NAME, word) - PEN;
        colour = mix(colour, INK, smooth_step(0.0, 1.0, 0.5 - pen * LETTER_HEIGHT / SHARPNESS));
        let crimp = smooth_step(0.0, 1.0, (along - CRIMP_BEGINS) / 0.008);
        let ridge = p.z * TAU / (RIDGE * length);
        colour = mix(colour, SHADE, 0.22 * crimp * (0.5 - 0.5 * ridge.cos()));
        let slope = Vector3::z() * (-0.55 * crimp * ridge.sin());
        Paint { colour, slope }
    }
}

/// Two tapered waves below the name.
fn swoosh(colour: [f64; 3], along: f64, up: f64) -> [f64; 3] {
    let t = ((along - SWOOSH.0) / (SWOOSH.1 - SWOOSH.0)).clamp(0.0, 1.0);
    let taper = (t * (1.0 - t) * 4.0).powf(0.7);
    let middle = -0.083 + 0.011 * (t * TAU * 0.6).cos();
    let edge = |centre: f64, half: f64| {
        smooth_step(0.0, 1.0, 0.5 + (half * taper - (up - centre).abs()) / SHARPNESS)
            * f64::from(taper > 0.0)
    };
    let wide = edge(middle, 0.016);
    let thin = edge(middle - 0.027 + 0.008 * t, 0.0055);
    mix(mix(colour, WAVE, wide), ACCENT, thin)
}

const NAME: &str = "softgrasp";
// Lengths below are parts of the tube's length.
const LETTER_HEIGHT: f64 = 0.049;
/// Middle of the word, from the middle of the tube towards the crimp.
const WORD_MIDDLE: f64 = -0.035;
/// How far the base line is below the middle, in letters.
const WORD_BASE: f64 = 0.25;
/// Half the width of a stroke, in letters.
const PEN: f64 = 0.135;
/// Width over which edges fade: about one texel.
const SHARPNESS: f64 = 0.0012;
const SWOOSH: (f64, f64) = (0.13, 0.86);
const CRIMP_BEGINS: f64 = 0.925;
/// Distance of the ridges.
const RIDGE: f64 = 0.0105;
const WHITE: [f64; 3] = [0.95, 0.97, 0.965];
const MINT: [f64; 3] = [0.55, 0.87, 0.79];
const INK: [f64; 3] = [0.03, 0.20, 0.42];
const WAVE: [f64; 3] = [0.05, 0.66, 0.62];
const ACCENT: [f64; 3] = [0.95, 0.36, 0.30];
const SHADE: [f64; 3] = [0.16, 0.38, 0.36];
