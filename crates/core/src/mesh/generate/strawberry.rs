//! The strawberry: a tapered body of revolution, dented at the top, pitted where the mesh is fine.

use nalgebra::{Point3, Vector3};

/// Depth below the strawberry's surface; see [`super::solid::Solid::depth`].
///
/// With `s = y / HALF_HEIGHT`: `(ρ / w(s))² + (s + dent(ρ))² = 1`, where the half width `w` grows
/// from the tip up and `dent` lowers the top around the stalk.
pub(super) fn depth(p: &Point3<f64>, spacing: f64) -> f64 {
    let s = (p.y / HALF_HEIGHT).clamp(-1.5, 1.5);
    let width = HALF_WIDTH * (0.80 + 0.26 * s - 0.13 * s * s);
    let rho_squared = p.x * p.x + p.z * p.z;
    let upper = s.max(0.0);
    let dent = DENT * upper * upper / (1.0 + rho_squared / (DENT_RADIUS * DENT_RADIUS)).powi(2);
    let height = p.y / HALF_HEIGHT + dent;
    let level = (rho_squared / (width * width) + height * height).sqrt();
    (1.0 - level) * 0.7 * HALF_WIDTH - pits(p, spacing)
}

/// Half the edges of the box around the strawberry.
pub(super) fn half_extent() -> Vector3<f64> {
    Vector3::new(HALF_WIDTH, HALF_HEIGHT, HALF_WIDTH)
}

/// Depth of the pits the seeds sit in, staggered around the fruit; 0 on lattices too coarse.
fn pits(p: &Point3<f64>, spacing: f64) -> f64 {
    let strength = ((PIT_SPACING_MAX - spacing) / (0.4 * PIT_SPACING_MAX)).clamp(0.0, 1.0);
    if strength == 0.0 {
        return 0.0;
    }
    let around = (PIT_COLUMNS * p.z.atan2(p.x)).cos();
    let along = (PIT_ROWS * p.y / HALF_HEIGHT).cos();
    let rho = p.x.hypot(p.z);
    // Columns run together at the axis; the pits fade out before they do.
    let fade = (rho / (0.5 * HALF_WIDTH) - 0.3).clamp(0.0, 1.0);
    let pit = (around * along - 0.5).max(0.0);
    PIT_DEPTH * strength * fade * 4.0 * pit * pit
}

/// Half of the height without the dent, which leaves 6.5 cm.
const HALF_HEIGHT: f64 = 0.0348;
/// Half width of the widest place, a little above the middle; `w` stays below it.
const HALF_WIDTH: f64 = 0.028;
/// Depth of the dent at the axis, in half heights.
const DENT: f64 = 0.35;
/// Radius of the dent.
const DENT_RADIUS: f64 = 0.009;
/// Coarsest lattice that shows pits: four points from one pit to the next.
const PIT_SPACING_MAX: f64 = 0.0019;
const PIT_DEPTH: f64 = 0.0006;
const PIT_COLUMNS: f64 = 11.0;
const PIT_ROWS: f64 = 14.0;
