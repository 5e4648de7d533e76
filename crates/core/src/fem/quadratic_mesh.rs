//! The ten-node mesh made from a linear one: a node in the middle of every edge.

use nalgebra::Point3;
use rayon::prelude::*;

use super::tet10::EDGES;
use crate::mesh::TetMesh;

/// Straight-sided mesh of ten-node tetrahedra.
///
/// Shapes: N corner nodes numbered as in the linear mesh (node i < N is its node i, orphans too),
/// then one node for each of the E edges, edges sorted by their lower and then their higher
/// corner; `tets` M × 10: corners 1 … 4 as in the linear mesh, then the middles of edges
/// 12, 23, 13, 14, 24, 34 ([`EDGES`]). Units and frame: those of the linear mesh.
/// Invariant: every index is below N + E, 3 (N + E) degrees of freedom fit `u32`, every element
/// has positive volume, every mid-edge node lies halfway between its corners.
///
/// The order of the six edges is that of VTK (`VTK_QUADRATIC_TETRA`) and Abaqus/CalculiX (C3D10);
/// Gmsh (type 11) has the last two exchanged. All of them count the volume positive that the
/// thesis (3.23) counts negative, so an element is handed over through [`super::tet10::MIRRORED`].
#[derive(Clone, Debug, PartialEq)]
pub struct QuadraticMesh {
    corner_count: usize,
    vertices: Vec<Point3<f64>>,
    edges: Vec<[u32; 2]>,
    tets: Vec<[u32; 10]>,
    regions: Vec<u32>,
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
    /// Adds the mid-edge nodes of a linear mesh.
    ///
    /// # Errors
    /// [`TooManyNodes`] if the degrees of freedom would not fit `u32`.
    ///
    /// Source: edges as in [`EDGES`]; corners as in thesis Table 3.1, list 2.
    pub fn try_new(mesh: &TetMesh) -> Result<Self, TooManyNodes> {
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
        Ok(Self { corner_count, vertices, edges, tets, regions: mesh.regions().to_vec() })
    }

    /// Number N of corner nodes: the nodes of the linear mesh, its orphans included.
    pub fn corner_count(&self) -> usize {
        self.corner_count
    }

    /// Number N + E of all nodes.
    pub fn node_count(&self) -> usize {
        self.vertices.len()
    }

    /// Coordinates of the corner nodes, then of the mid-edge nodes.
    pub fn vertices(&self) -> &[Point3<f64>] {
        &self.vertices
    }

    /// Corners of every edge, lower one first; the middle of edge e is node N + e.
    pub fn edges(&self) -> &[[u32; 2]] {
        &self.edges
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
mod tests {
    use std::collections::BTreeMap;

    use super::*;
    use crate::mesh::{BuiltIn, generate};

    #[test]
    fn corners_keep_their_numbers_and_orphans_get_no_edges() {
        let vertices =
            [[1.0, 0.0, 0.0], [9.0, 9.0, 9.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [0.0; 3]]
                .map(Point3::from);
        let linear = TetMesh::try_new(vertices.to_vec(), vec![[0, 2, 3, 4]], vec![7]).unwrap();
        let mesh = QuadraticMesh::try_new(&linear).unwrap();
        assert_eq!((mesh.corner_count(), mesh.node_count()), (5, 11));
        assert_eq!(mesh.vertices()[..5], vertices);
        assert_eq!(mesh.edges(), [[0, 2], [0, 3], [0, 4], [2, 3], [2, 4], [3, 4]]);
        // Edges 12, 23, 13, 14, 24, 34 of corners 0, 2, 3, 4.
        assert_eq!(mesh.tets(), [[0, 2, 3, 4, 5, 8, 6, 7, 9, 10]]);
        assert_eq!(mesh.regions(), [7]);
        assert_eq!(mesh.used_nodes().iter().filter(|u| !**u).count(), 1);
        assert!(!mesh.used_nodes()[1]);
    }

    /// Numbers the edges through a map from pairs of corners instead of a sorted list.
    fn naive_tets(linear: &TetMesh) -> Vec<[u32; 10]> {
        let mut numbers = BTreeMap::new();
        for c in linear.tets() {
            for [a, b] in EDGES {
                numbers.insert((c[a].min(c[b]), c[a].max(c[b])), 0);
            }
        }
        for (i, number) in numbers.values_mut().enumerate() {
            *number = (linear.node_count() + i) as u32;
        }
        let number = |a: u32, b: u32| numbers[&(a.min(b), a.max(b))];
        let tets = linear.tets().iter();
        tets.map(|&[a, b, c, d]| {
            let edges = [(a, b), (b, c), (a, c), (a, d), (b, d), (c, d)];
            let [e1, e2, e3, e4, e5, e6] = edges.map(|(a, b)| number(a, b));
            [a, b, c, d, e1, e2, e3, e4, e5, e6]
        })
        .collect()
    }

    #[test]
    fn built_in_objects_get_one_node_per_edge_in_its_middle() {
        for shape in [BuiltIn::Cube, BuiltIn::Sphere, BuiltIn::Strawberry, BuiltIn::Toothpaste] {
            let linear = generate(shape, 300).unwrap();
            let mesh = QuadraticMesh::try_new(&linear).unwrap();
            assert_eq!(mesh.tets(), naive_tets(&linear));
            assert!(mesh.edges().is_sorted_by(|a, b| a < b));
            for tet in mesh.tets() {
                for (node, [a, b]) in tet[4..].iter().zip(EDGES) {
                    let at = |n: u32| mesh.vertices()[n as usize];
                    let off = at(*node) - nalgebra::center(&at(tet[a]), &at(tet[b]));
                    assert!(off.norm() <= 1e-16, "{shape:?}");
                }
            }
            // Euler characteristic of a ball: nodes − edges + faces − elements = 1, where
            // 2 faces = 4 elements + boundary faces.
            let boundary = crate::mesh::Surface::from_mesh(&linear).triangles.len() as i64;
            let [n, e, t] = [linear.node_count(), mesh.edges().len(), linear.tets().len()]
                .map(|count| count as i64);
            assert_eq!(n - e + (4 * t + boundary) / 2 - t, 1, "{shape:?}");
        }
    }

    #[test]
    fn middle_of_huge_coordinates_is_finite() {
        let (small, y, y_far) = (1e-150, 1.6e308, 1.7e308);
        let vertices = [[small, y, 0.0], [0.0, y_far, 0.0], [0.0, y, small], [0.0, y, 0.0]];
        let vertices = vertices.map(Point3::from).to_vec();
        let linear = TetMesh::try_new(vertices, vec![[0, 1, 2, 3]], vec![]).unwrap();
        let mesh = QuadraticMesh::try_new(&linear).unwrap();
        assert_eq!(mesh.vertices()[4], Point3::new(0.5 * small, 0.5 * y + 0.5 * y_far, 0.0));
        assert!(mesh.vertices().iter().all(|p| p.coords.iter().all(|c| c.is_finite())));
    }

    #[test]
    fn more_nodes_than_degrees_of_freedom_can_number_are_refused() {
        assert_eq!(check_node_count(NODES_MAX - 6, 6), Ok(()));
        let error = check_node_count(NODES_MAX - 5, 6).unwrap_err();
        assert_eq!(error, TooManyNodes { corners: NODES_MAX - 5, edges: 6 });
        assert!(error.to_string().contains("1431655765 nodes"), "{error}");
        assert!(check_node_count(usize::MAX, 6).is_err());
    }
}
