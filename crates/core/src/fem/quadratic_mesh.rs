//! The ten-node mesh of a linear one: with the mid-edge nodes that it brings along, or else with a node
//! that is made in the middle of every edge.

use nalgebra::Point3;
use rayon::prelude::*;

use super::mid_edge::{MidEdgeFault, edges_and_middles, ten_node_tets};
use super::tet4;
use super::tet10::EDGES;
use super::tet10_points::Points;
use crate::mesh::{MeshError, TetMesh};

/// Mesh of ten-node tetrahedra.
///
/// Shapes: `tets` M × 10: corners 1 … 4 as in the linear mesh, then the nodes of edges
/// 12, 23, 13, 14, 24, 34 ([`EDGES`]). The E edges are sorted by their lower and then their higher
/// corner. Units and frame: those of the linear mesh.
///
/// Where the linear mesh brings mid-edge nodes along, its N nodes are the nodes, under their own
/// numbers, and edges may be curved. Else edges are straight, and after the N nodes of the linear mesh
/// (orphans too) comes one for each edge, halfway between its corners.
/// Invariant: every index is below the number of nodes, 3 degrees of freedom for each fit `u32`, elements
/// that share an edge share its node, and every element has a positive Jacobian determinant at its points.
///
/// The order of the six edges is that of VTK (`VTK_QUADRATIC_TETRA`) and Abaqus/CalculiX (C3D10);
/// Gmsh (type 11) has the last two exchanged. All of them count the volume positive that the
/// thesis (3.23) counts negative, so an element is handed over through [`super::tet10::MIRRORED`].
#[derive(Clone, Debug, PartialEq)]
pub struct QuadraticMesh {
    corner_count: usize,
    vertices: Vec<Point3<f64>>,
    edges: Vec<[u32; 2]>,
    /// Node of each edge, where the mesh brought them along.
    middles: Vec<u32>,
    tets: Vec<[u32; 10]>,
    regions: Vec<u32>,
}

/// A linear mesh that has no ten-node counterpart.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum QuadraticMeshError {
    /// The nodes cannot be numbered.
    #[error(transparent)]
    TooManyNodes(#[from] TooManyNodes),
    /// Its own mid-edge nodes do not fit together.
    #[error(transparent)]
    MidEdge(#[from] MidEdgeFault),
}

/// A linear mesh whose ten-node counterpart cannot be numbered.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error(
    "the ten-node mesh would have {corners} corner nodes and {edges} mid-edge nodes; three degrees \
     of freedom each must be below 2^32, so at most {} nodes",
    NODES_MAX
)]
pub struct TooManyNodes {
    /// Nodes of the linear mesh.
    pub corners: usize,
    /// Edges of the mesh.
    pub edges: usize,
}

/// Most nodes whose degrees of freedom `3 n + axis` fit `u32`.
const NODES_MAX: usize = (u32::MAX / 3) as usize;

impl QuadraticMesh {
    /// Takes the mid-edge nodes of a linear mesh, or makes them where it has none.
    ///
    /// # Errors
    /// [`TooManyNodes`] if the degrees of freedom would not fit `u32`, [`MidEdgeFault`] if its own
    /// mid-edge nodes contradict each other or fold an element.
    ///
    /// Source: edges as in [`EDGES`]; corners as in thesis Table 3.1, list 2.
    pub fn try_new(mesh: &TetMesh) -> Result<Self, QuadraticMeshError> {
        match mesh.mid_edge_nodes().is_empty() {
            true => Ok(Self::straight(mesh)?),
            false => Self::curved(mesh),
        }
    }

    fn curved(mesh: &TetMesh) -> Result<Self, QuadraticMeshError> {
        let (edges, middles) = edges_and_middles(mesh)?;
        let corner_count = mesh.node_count();
        check_node_count(corner_count, 0)?;
        let tets = ten_node_tets(mesh)?;
        let (vertices, regions) = (mesh.vertices().to_vec(), mesh.regions().to_vec());
        Ok(Self { corner_count, vertices, edges, middles, tets, regions })
    }

    fn straight(mesh: &TetMesh) -> Result<Self, TooManyNodes> {
        let edges = edges_of(mesh);
        let corner_count = mesh.node_count();
        check_node_count(corner_count, edges.len())?;
        let mut vertices = mesh.vertices().to_vec();
        vertices.extend(edges.iter().map(|&[low, high]| {
            let [a, b] = [low, high].map(|n| mesh.vertices()[n as usize].coords);
            // Halved before they are added, so that the sum of two huge coordinates stays finite.
            Point3::from(a * 0.5 + b * 0.5)
        }));
        let middle = |a: u32, b: u32| {
            let edge = edges.partition_point(|e| *e < [a.min(b), a.max(b)]);
            (corner_count + edge) as u32
        };
        let tets = mesh
            .tets()
            .par_iter()
            .with_min_len(512)
            .map(|c| {
                let mut nodes = [0; 10];
                nodes[..4].copy_from_slice(c);
                for (node, [a, b]) in nodes[4..].iter_mut().zip(EDGES) {
                    *node = middle(c[a], c[b]);
                }
                nodes
            })
            .collect();
        let (middles, regions) = (Vec::new(), mesh.regions().to_vec());
        Ok(Self { corner_count, vertices, edges, middles, tets, regions })
    }

    /// The linear mesh with all nodes of this one: those that were made are its own mid-edge nodes then, after
    /// the others, and can be named.
    ///
    /// # Errors
    /// [`MeshError`] as for any list of nodes and elements.
    pub fn to_mesh(&self) -> Result<TetMesh, MeshError> {
        let corners = self.tets.iter().map(|nodes| std::array::from_fn(|i| nodes[i])).collect();
        let middles = self.tets.iter().map(|nodes| std::array::from_fn(|i| nodes[4 + i])).collect();
        TetMesh::try_new(self.vertices.clone(), corners, self.regions.clone())?
            .with_mid_edge_nodes(middles)
    }

    /// Number N of the nodes of the linear mesh, its orphans included; what was made comes after them.
    pub fn corner_count(&self) -> usize {
        self.corner_count
    }

    /// Whether the mid-edge nodes are the mesh's own, so that edges may be curved.
    pub fn is_curved(&self) -> bool {
        !self.middles.is_empty()
    }

    /// Number of all nodes.
    pub fn node_count(&self) -> usize {
        self.vertices.len()
    }

    /// Coordinates of the nodes of the linear mesh, then of the mid-edge nodes that were made.
    pub fn vertices(&self) -> &[Point3<f64>] {
        &self.vertices
    }

    /// Corners of every edge, lower one first.
    pub fn edges(&self) -> &[[u32; 2]] {
        &self.edges
    }

    /// The mid-edge node between two corners; `None` if no element has that edge.
    pub fn middle(&self, a: u32, b: u32) -> Option<u32> {
        let edge = self.edges.binary_search(&[a.min(b), a.max(b)]).ok()?;
        Some(self.middles.get(edge).copied().unwrap_or((self.corner_count + edge) as u32))
    }

    /// Node indices, ten per element, in the order given at [`QuadraticMesh`].
    pub fn tets(&self) -> &[[u32; 10]] {
        &self.tets
    }

    /// Region label per element; empty when the mesh has one region.
    pub fn regions(&self) -> &[u32] {
        &self.regions
    }

    /// Corner coordinates of one element.
    pub fn corners(&self, tet: usize) -> [Point3<f64>; 4] {
        let [a, b, c, d, ..] = self.tets[tet];
        [a, b, c, d].map(|n| self.vertices[n as usize])
    }

    /// One element at rest at its four points.
    pub fn points(&self, tet: usize) -> Points {
        match self.is_curved() {
            true => Points::curved(&self.tets[tet].map(|n| self.vertices[n as usize])),
            false => Points::straight(&tet4::gradients(&self.corners(tet))),
        }
    }

    /// For each node, whether some element uses it; mid-edge nodes always are.
    pub fn used_nodes(&self) -> Vec<bool> {
        let mut used = vec![false; self.node_count()];
        for &n in self.tets.iter().flatten() {
            used[n as usize] = true;
        }
        used
    }
}

/// Every edge once, sorted, the lower corner first.
fn edges_of(mesh: &TetMesh) -> Vec<[u32; 2]> {
    let mut edges: Vec<[u32; 2]> = mesh
        .tets()
        .iter()
        .flat_map(|c| EDGES.map(|[a, b]| [c[a].min(c[b]), c[a].max(c[b])]))
        .collect();
    // Equal entries are the same edge, so an unstable sort has one outcome only.
    edges.par_sort_unstable();
    edges.dedup();
    edges.shrink_to_fit();
    edges
}

fn check_node_count(corners: usize, edges: usize) -> Result<(), TooManyNodes> {
    match corners.checked_add(edges) {
        Some(nodes) if nodes <= NODES_MAX => Ok(()),
        _ => Err(TooManyNodes { corners, edges }),
    }
}

#[cfg(test)]
mod tests;
