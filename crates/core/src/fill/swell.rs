//! Volume of what a surface encloses, by formula or by counting points; and the boundary of a mesh, moved so
//! that it encloses that volume.

use nalgebra::{Point3, Vector3};
use rayon::prelude::*;

use super::octree::Octree;
use super::skin::{Skin, is_inside};
use crate::mesh::{Surface, TetMesh};

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

/// A mesh whose boundary was moved.
pub(super) struct Swollen {
    pub(super) mesh: TetMesh,
    /// Largest way of a node.
    pub(super) moved: f64,
}

/// Moves nodes of the boundary outward by how far the surface bulges over their triangles, all by the
/// same factor, until the volume is `volume`; where the bulges are not enough, by equal shares of the
/// length of the triangles' edges. What would spoil an element is not done.
///
/// Nodes on a curved surface have chords between them, which cut off volume: bodies of coarse cells
/// would be too soft.
pub(super) fn swell(skin: &Skin, mesh: TetMesh, volume: f64) -> Swollen {
    let start = mesh.clone();
    let surface = Surface::from_mesh(&mesh);
    let bulges = bulges(skin, &mesh, &surface);
    let mut swollen = toward(mesh, &bulges, volume, BULGE_FACTOR_MAX);
    let left = (volume - volume_of(&swollen)).abs();
    if left > 1e-6 * volume {
        let evenly = evenly(&swollen, &surface);
        swollen = toward(swollen, &evenly, volume, EVEN_FACTOR_MAX);
    }
    let way = |(a, b): (&Point3<f64>, &Point3<f64>)| (a - b).norm();
    let moved = start.vertices().iter().zip(swollen.vertices()).map(way).fold(0.0, f64::max);
    Swollen { mesh: swollen, moved }
}

/// Volume of all elements.
pub(super) fn volume_of(mesh: &TetMesh) -> f64 {
    (0..mesh.tets().len()).map(|t| mesh.signed_volume(t)).sum()
}

/// Moves every node by a common multiple of its `way`, at most `most`, as near to `volume` as that
/// brings and no element loses more than a part of its volume.
fn toward(mesh: TetMesh, ways: &[Vector3<f64>], volume: f64, most: f64) -> TetMesh {
    let moved = |factor: f64| {
        let vertices = mesh.vertices().iter().zip(ways).map(|(p, way)| p + way * factor);
        mesh.with_vertices(vertices.collect()).ok()
    };
    let is_sound = |other: &TetMesh| {
        (0..mesh.tets().len()).all(|t| other.signed_volume(t) > LEAST_SHARE * mesh.signed_volume(t))
    };
    // The volume is nearly linear in the factor: secants from both ends of a small step.
    let probe = 0.01 * most;
    let Some(at_probe) = moved(probe) else { return mesh };
    let (from, mut slope) = (volume_of(&mesh), (volume_of(&at_probe) - volume_of(&mesh)) / probe);
    let mut factor = 0.0;
    let mut reached = from;
    for _ in 0..4 {
        if slope == 0.0 {
            return mesh;
        }
        let next = (factor + (volume - reached) / slope).clamp(-most, most);
        let Some(there) = moved(next) else { return mesh };
        let volume_there = volume_of(&there);
        if next != factor {
            slope = (volume_there - reached) / (next - factor);
        }
        (factor, reached) = (next, volume_there);
    }
    for _ in 0..8 {
        match moved(factor) {
            Some(there) if is_sound(&there) => return there,
            _ => factor *= 0.5,
        }
    }
    mesh
}

/// How far the surface lies outside of the triangles around each node, along the node's normal.
fn bulges(skin: &Skin, mesh: &TetMesh, surface: &Surface) -> Vec<Vector3<f64>> {
    let heights: Vec<(f64, Vector3<f64>)> = surface
        .triangles
        .par_iter()
        .map(|t| {
            let [a, b, c] = t.map(|n| mesh.vertices()[n as usize]);
            let normal = (b - a).cross(&(c - a)) * 0.5;
            let middle = Point3::from((a.coords + b.coords + c.coords) / 3.0);
            let out = normal.try_normalize(0.0).unwrap_or_default();
            let way = skin.tree.closest(&middle).point - middle;
            let height = way.dot(&out);
            let edge = normal.norm().sqrt();
            // Beside a hole, or where another part of the surface is closest, nothing is known.
            let is_above = height.abs() > 0.7 * way.norm() && height.abs() < 0.4 * edge;
            (if is_above { height } else { 0.0 }, normal)
        })
        .collect();
    let mut sums = vec![(0.0, 0.0, Vector3::zeros()); mesh.node_count()];
    for (t, (height, normal)) in surface.triangles.iter().zip(&heights) {
        for n in t {
            let sum: &mut (f64, f64, Vector3<f64>) = &mut sums[*n as usize];
            sum.0 += height * normal.norm();
            sum.1 += normal.norm();
            sum.2 += normal;
        }
    }
    sums.iter()
        .map(|(height, area, normal)| {
            if *area == 0.0 {
                return Vector3::zeros();
            }
            normal.try_normalize(0.0).unwrap_or_default() * (height / area)
        })
        .collect()
}

/// The outward normal of every boundary node, as long as the edges of its triangles.
fn evenly(mesh: &TetMesh, surface: &Surface) -> Vec<Vector3<f64>> {
    let mut sums = vec![(Vector3::zeros(), 0.0, 0.0); mesh.node_count()];
    for t in &surface.triangles {
        let [a, b, c] = t.map(|n| mesh.vertices()[n as usize]);
        let normal = (b - a).cross(&(c - a)) * 0.5;
        for n in t {
            let sum: &mut (Vector3<f64>, f64, f64) = &mut sums[*n as usize];
            sum.0 += normal;
            sum.1 += normal.norm().sqrt();
            sum.2 += 1.0;
        }
    }
    sums.iter()
        .map(|(normal, edges, count)| match *count > 0.0 {
            true => normal.try_normalize(0.0).unwrap_or_default() * (edges / count),
            false => Vector3::zeros(),
        })
        .collect()
}

/// Nodes move by this multiple of the bulges at most; on a sphere about 1 is right.
const BULGE_FACTOR_MAX: f64 = 3.0;
/// And by this part of an edge where that is not enough.
const EVEN_FACTOR_MAX: f64 = 0.15;
/// Part of its volume that every element keeps.
const LEAST_SHARE: f64 = 0.3;

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
