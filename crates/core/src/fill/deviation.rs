//! How far a surface and the boundary of its mesh are apart, both ways.

use nalgebra::{Point3, Vector3};
use rayon::prelude::*;

use super::skin::Skin;
use crate::mesh::{Surface, TetMesh};
use crate::surface::{SurfaceTree, TriangleSurface};

/// Distances of points of one surface from another one.
///
/// Units: the surface's.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Deviation {
    /// Root mean square, weighted by area.
    pub rms: f64,
    /// Largest distance, m.
    pub max: f64,
    /// The point with the largest distance.
    pub at: Point3<f64>,
}

/// What is known of the boundary of a mesh against the surface it was made from.
#[derive(Clone, Copy, Debug)]
pub(super) struct Deviations {
    /// From corners and middles of the skin's triangles to the mesh.
    pub(super) surface_to_mesh: Deviation,
    /// From nodes and middles of the mesh's boundary to the surface, where it is no cover of a hole.
    pub(super) mesh_to_surface: Deviation,
    /// Share of the boundary that covers holes: the surface is not there.
    pub(super) covered: f64,
}

/// A place on one surface: where, which way is out, and how much area it stands for.
struct Sample {
    point: Point3<f64>,
    normal: Vector3<f64>,
    area: f64,
}

/// Measures both ways; only an open surface has holes to cover.
pub(super) fn deviations(skin: &Skin, mesh: &TetMesh, is_open: bool) -> Option<Deviations> {
    let boundary = boundary(mesh)?;
    let boundary_tree = SurfaceTree::new(&boundary);
    let skin_samples = samples(&skin.surface, |t| skin.is_skin[t]);
    let from_surface: Vec<f64> =
        skin_samples.par_iter().map(|s| boundary_tree.closest(&s.point).distance).collect();
    let boundary_samples = samples(&boundary, |_| true);
    let from_mesh: Vec<(f64, bool)> = boundary_samples
        .par_iter()
        .map(|sample| {
            let distance = skin.tree.closest(&sample.point).distance;
            // The winding number jumps by one at a triangle and falls slowly over a hole.
            let edge = 3.0 * sample.area.sqrt();
            let off = sample.normal * (1.5 * distance).clamp(LEAST_OFF * edge, MOST_OFF * edge);
            let jump =
                skin.tree.winding(&(sample.point - off)) - skin.tree.winding(&(sample.point + off));
            (distance, is_open && jump < 0.5)
        })
        .collect();
    let is_cover = |i: usize| from_mesh[i].1;
    let area = |keep: &dyn Fn(usize) -> bool| -> f64 {
        (0..boundary_samples.len()).filter(|i| keep(*i)).map(|i| boundary_samples[i].area).sum()
    };
    let covered = area(&is_cover) / area(&|_| true);
    let distances: Vec<f64> = from_mesh.iter().map(|(d, _)| *d).collect();
    Some(Deviations {
        surface_to_mesh: deviation(&skin_samples, &from_surface, |_| true),
        mesh_to_surface: deviation(&boundary_samples, &distances, |i| !is_cover(i)),
        covered,
    })
}

/// The boundary of a mesh; `None` without elements.
pub(super) fn boundary(mesh: &TetMesh) -> Option<TriangleSurface> {
    let surface = Surface::from_mesh(mesh);
    TriangleSurface::try_new(mesh.vertices().to_vec(), surface.triangles).ok()
}

/// Middles and corners of triangles, each with a quarter of the area.
fn samples(surface: &TriangleSurface, keep: impl Fn(usize) -> bool) -> Vec<Sample> {
    (0..surface.triangles().len())
        .filter(|t| keep(*t))
        .flat_map(|t| {
            let [a, b, c] = surface.corners(t);
            let middle = Point3::from((a.coords + b.coords + c.coords) / 3.0);
            let normal = (b - a).cross(&(c - a));
            let area = normal.norm() / 8.0;
            let normal = normal.try_normalize(0.0).unwrap_or_default();
            [a, b, c, middle].map(|point| Sample { point, normal, area })
        })
        .collect()
}

fn deviation(samples: &[Sample], distances: &[f64], keep: impl Fn(usize) -> bool) -> Deviation {
    let mut found = Deviation { rms: 0.0, max: 0.0, at: Point3::origin() };
    let (mut squares, mut area) = (0.0, 0.0);
    for i in (0..samples.len()).filter(|i| keep(*i)) {
        squares += samples[i].area * distances[i].powi(2);
        area += samples[i].area;
        if distances[i] > found.max {
            (found.max, found.at) = (distances[i], samples[i].point);
        }
    }
    found.rms = if area > 0.0 { (squares / area).sqrt() } else { 0.0 };
    found
}

/// Distances, in edges of a triangle, at which the two sides of the boundary are looked at.
const LEAST_OFF: f64 = 1e-3;
const MOST_OFF: f64 = 0.5;
