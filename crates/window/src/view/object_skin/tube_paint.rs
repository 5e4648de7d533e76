//! The print on a toothpaste tube: its name, a swoosh below it, ridges on the crimp.

use std::f64::consts::{FRAC_PI_2, TAU};

use nalgebra::{Point3, Vector3};

use super::bake::Paint;
use super::lettering::{distance_to_word, word_width};
use super::tube_profile::{TubePlace, TubeProfile};
use crate::view::blend::{mix, smooth_step};

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
