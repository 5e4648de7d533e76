//! The toothpaste tube: a round nozzle and shoulder at one end, a flat wide crimp at the other.

use nalgebra::{Point3, Vector3};

/// Depth below the tube's surface; see [`super::solid::Solid::depth`].
///
/// The tube lies along X, nozzle at −X; its cross-section is a superellipse that turns from a
/// circle into a flat bar towards the crimp.
pub(super) fn depth(p: &Point3<f64>, spacing: f64) -> f64 {
    let t = ((p.x + HALF_LENGTH) / (2.0 * HALF_LENGTH)).clamp(0.0, 1.0);
    let shoulder = smooth_step((t - 0.09) / 0.06);
    let body = smooth_step((t - 0.15) / 0.85);
    let body_height = SHOULDER_RADIUS + (CRIMP_HALF_HEIGHT - SHOULDER_RADIUS) * body;
    let body_width = SHOULDER_RADIUS + (CRIMP_HALF_WIDTH - SHOULDER_RADIUS) * body;
    let least = THINNEST * spacing;
    let height = (NOZZLE_RADIUS + (body_height - NOZZLE_RADIUS) * shoulder).max(least);
    let width = (NOZZLE_RADIUS + (body_width - NOZZLE_RADIUS) * shoulder).max(least);
    let power = 2.0 + 2.0 * body;
    let level = (p.y / height).abs().powf(power) + (p.z / width).abs().powf(power);
    let side = (1.0 - level.powf(1.0 / power)) * height.min(width);
    side.min(HALF_LENGTH - p.x.abs())
}

/// Half the edges of the box around the tube.
pub(super) fn half_extent(spacing: f64) -> Vector3<f64> {
    let least = THINNEST * spacing;
    Vector3::new(HALF_LENGTH, SHOULDER_RADIUS.max(least), CRIMP_HALF_WIDTH.max(least))
}

/// 0 below 0, 1 above 1, smooth between.
fn smooth_step(t: f64) -> f64 {
    let t = t.clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

/// Half of the length of 15 cm.
const HALF_LENGTH: f64 = 0.075;
const NOZZLE_RADIUS: f64 = 0.008;
/// Half of the height of 3 cm, right behind the shoulder.
const SHOULDER_RADIUS: f64 = 0.015;
/// Half of the width of 4 cm, at the crimp.
const CRIMP_HALF_WIDTH: f64 = 0.020;
const CRIMP_HALF_HEIGHT: f64 = 0.0025;
/// Smallest half thickness a lattice can carry in one piece, in spacings.
const THINNEST: f64 = 0.55;
