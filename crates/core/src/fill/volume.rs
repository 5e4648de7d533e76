//! Volume of what a surface encloses, by formula or by counting points.

use nalgebra::Vector3;
use rayon::prelude::*;

use super::octree::Octree;
use super::skin::{Skin, is_inside};

/// Volume, and how it was found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct EnclosedVolume {
    pub(super) volume: f64,
    /// How far it may be off: 0 where the surface is closed and without overlap.
    pub(super) error: f64,
}

/// Volume inside of a surface.
///
/// The divergence theorem holds where every edge joins two triangles and all of them are skin.
/// Elsewhere cubes are halved along the skin and holes, whole ones are counted by their centre, those
/// at the border by points in them.
pub(super) fn enclosed(skin: &Skin, is_closed: bool) -> EnclosedVolume {
    if is_closed && skin.is_skin.iter().all(|s| *s) {
        return EnclosedVolume { volume: skin.surface.signed_volume(), error: 0.0 };
    }
    let spacing = skin.surface.size() / CUBES;
    let shift = [0.37, 0.61, 0.23];
    let tree = Octree::new(skin.surface.bounds(), spacing, shift, |centre, distance| {
        // The border over a hole is no triangle; there the winding number is between.
        let closest = skin.tree.closest(centre).distance;
        let is_border = closest <= distance || (skin.tree.winding(centre) - 0.5).abs() < 0.4;
        if is_border { spacing * (1.0 + 1e-9) } else { f64::INFINITY }
    });
    let leaves: Vec<_> = tree.leaves().collect();
    let parts: Vec<(f64, f64)> = leaves
        .into_par_iter()
        .enumerate()
        .map(|(number, (key, level))| {
            let edge = tree.edge(level);
            let half = Octree::length(level) / 2;
            let centre = tree.position(key.map(|i| i + half));
            let low = tree.position(key);
            if skin.tree.closest(&centre).distance > 0.87 * edge
                && (skin.tree.winding(&centre) - 0.5).abs() > 0.4
            {
                let share = if is_inside(&skin.tree, &centre) { 1.0 } else { 0.0 };
                return (share * edge.powi(3), 0.0);
            }
            // One sequence through all cubes: a face that lies like the cubes is no worse.
            let inside = (0..POINTS).filter(|i| {
                let place =
                    Vector3::from(ROOTS).map(|root| (root * (POINTS * number + i) as f64).fract());
                is_inside(&skin.tree, &(low + place * edge))
            });
            let share = inside.count() as f64 / POINTS as f64;
            // As if the points were drawn by chance; a sequence does better.
            let variance = (share * (1.0 - share)).max(0.1 / POINTS as f64) / POINTS as f64;
            (share * edge.powi(3), variance * edge.powi(6))
        })
        .collect();
    let volume = parts.iter().map(|(volume, _)| volume).sum();
    let variance: f64 = parts.iter().map(|(_, variance)| variance).sum();
    EnclosedVolume { volume, error: 3.0 * variance.sqrt() }
}

/// Cubes along the surface where points are counted.
const CUBES: f64 = 32.0;
/// Points in a cube at the border.
const POINTS: usize = 32;
/// Steps of points that fill a cube evenly: powers of the root of x⁴ = x + 1.
const ROOTS: [f64; 3] = [0.819_172_513, 0.671_043_607, 0.549_700_478];

#[cfg(test)]
mod tests {
    use nalgebra::Point3;

    use super::*;
    use crate::surface::samples::{ball, both, cuboid, without};

    #[test]
    fn counted_volumes_are_those_of_the_formulas() {
        let one = ball(3, Point3::origin(), 1.0);
        let exact = enclosed(&Skin::new(&one), true);
        assert!(exact.error == 0.0 && (exact.volume / one.signed_volume() - 1.0).abs() < 1e-12);
        let counted = enclosed(&Skin::new(&one), false);
        let off = (counted.volume - exact.volume).abs();
        assert!(off < counted.error && counted.error < 5e-3 * exact.volume, "{off}");
        // Two boxes that share a quarter of each.
        let box_at = |x| cuboid(Point3::new(x, 0.0, 0.0), Vector3::new(1.0, 0.6, 0.7));
        let overlap = enclosed(&Skin::new(&both(&box_at(0.0), &box_at(0.75))), true);
        let off = (overlap.volume - 1.75 * 0.42).abs();
        assert!(off < overlap.error && overlap.error < 0.01, "{off}, {}", overlap.error);
        // A few triangles missing change little.
        let open = without(&one, |t| t % 60 != 7);
        let open = enclosed(&Skin::new(&open), false);
        assert!((open.volume / exact.volume - 1.0).abs() < 0.02, "{}", open.volume);
    }
}
