//! Holes of a surface: where edges belong to one triangle only.

use nalgebra::{Point3, Vector3};

use super::TriangleSurface;
use crate::mesh::DisjointSets;

/// Open edges that hang together.
///
/// Units: the surface's. Frame: the surface's.
#[derive(Clone, Debug, PartialEq)]
pub struct Hole {
    /// Mean of its edges by length.
    pub centre: Point3<f64>,
    /// Length of all its edges.
    pub rim: f64,
    /// Number of its edges.
    pub edges: usize,
}

impl Hole {
    /// The holes that open edges of a surface make, longest rim first.
    pub(super) fn of_edges(surface: &TriangleSurface, edges: &[[u32; 2]]) -> Vec<Self> {
        let mut sets = DisjointSets::new(surface.points().len());
        for [a, b] in edges {
            sets.join(*a as usize, *b as usize);
        }
        let mut by_root: Vec<(usize, [u32; 2])> =
            edges.iter().map(|e| (sets.root(e[0] as usize), *e)).collect();
        by_root.sort_unstable();
        let mut holes: Vec<Self> = by_root
            .chunk_by(|a, b| a.0 == b.0)
            .map(|rim| {
                let (mut length, mut sum) = (0.0, Vector3::zeros());
                for (_, ends) in rim {
                    let [a, b] = ends.map(|n| surface.points()[n as usize]);
                    let edge = (b - a).norm();
                    length += edge;
                    sum += (a.coords + b.coords) * (0.5 * edge);
                }
                Self { centre: Point3::from(sum / length), rim: length, edges: rim.len() }
            })
            .collect();
        holes.sort_by(|a, b| b.rim.total_cmp(&a.rim));
        holes
    }
}
