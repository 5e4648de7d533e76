//! Moves the boundary of a mesh so that it encloses the right volume.

use nalgebra::{Point3, Vector3};
use rayon::prelude::*;

use super::skin::Skin;
use crate::mesh::{Surface, TetMesh};

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
