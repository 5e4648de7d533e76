//! Mid-edge nodes that a mesh brings along: one for each edge, the same in all elements around it.

use rayon::prelude::*;

use super::tet10::EDGES;
use super::tet10_points::jacobians;
use crate::mesh::TetMesh;

/// Mid-edge nodes of a mesh that no ten-node elements can have.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum MidEdgeFault {
    /// Neighbours have different mid-edge nodes on the edge that they share.
    #[error(
        "the edge from node {} to node {} has mid-edge node {middle} in tetrahedron {tet} and {other} in \
         tetrahedron {other_tet} (0-based); elements that share an edge share its mid-edge node",
        edge[0], edge[1]
    )]
    TwoMiddles {
        /// Corners of the edge.
        edge: [u32; 2],
        /// An element at the edge, from 0.
        tet: u32,
        /// Mid-edge node of the first element.
        middle: u32,
        /// Another element at the edge.
        other_tet: u32,
        /// Mid-edge node of the other element.
        other: u32,
    },
    /// One node is in the middle of two edges.
    #[error(
        "node {node} is the mid-edge node of the edge from node {} to node {} and of that from node {} to \
         node {} (0-based)", edges[0][0], edges[0][1], edges[1][0], edges[1][1]
    )]
    TwoEdges {
        /// The node.
        node: u32,
        /// Corners of both edges.
        edges: [[u32; 2]; 2],
    },
    /// A mid-edge node is a corner as well.
    #[error(
        "node {node} is the mid-edge node of tetrahedron {tet} between nodes {} and {}, and a corner as \
         well (0-based)", edge[0], edge[1]
    )]
    Corner {
        /// The node.
        node: u32,
        /// Element, from 0.
        tet: u32,
        /// Corners of its edge.
        edge: [u32; 2],
    },
    /// An element is curved so far that it folds.
    #[error(
        "tetrahedron {tet} (0-based) is curved too much: at one of its four points the Jacobian \
         determinant is {determinant:e}, which must be above 0; move its mid-edge nodes nearer to the \
         middles of its edges"
    )]
    Folded {
        /// Element, from 0.
        tet: usize,
        /// The determinant, m³.
        determinant: f64,
    },
}

/// One edge of one element.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct EdgeOfTet {
    /// Lower corner first.
    edge: [u32; 2],
    tet: u32,
    middle: u32,
}

/// Every edge of a mesh once, sorted, the lower corner first, and the mid-edge node of each.
///
/// Shapes: E edges; `mesh` with mid-edge nodes.
///
/// # Errors
/// [`MidEdgeFault`] naming elements and nodes that do not fit together.
pub(super) fn edges_and_middles(mesh: &TetMesh) -> Result<(Vec<[u32; 2]>, Vec<u32>), MidEdgeFault> {
    let mut all: Vec<EdgeOfTet> = Vec::with_capacity(6 * mesh.tets().len());
    for ((tet, c), middles) in (0u32..).zip(mesh.tets()).zip(mesh.mid_edge_nodes()) {
        let ends = EDGES.map(|[a, b]| [c[a].min(c[b]), c[a].max(c[b])]);
        all.extend(ends.into_iter().zip(middles).map(|(edge, &middle)| EdgeOfTet {
            edge,
            tet,
            middle,
        }));
    }
    all.par_sort_unstable();
    for pair in all.windows(2) {
        let [a, b] = [pair[0], pair[1]];
        if a.edge == b.edge && a.middle != b.middle {
            let EdgeOfTet { edge, tet, middle } = a;
            let (other_tet, other) = (b.tet, b.middle);
            return Err(MidEdgeFault::TwoMiddles { edge, tet, middle, other_tet, other });
        }
    }
    all.dedup_by_key(|own| own.edge);
    let is_corner = mesh.is_corner();
    if let Some(own) = all.iter().find(|own| is_corner[own.middle as usize]) {
        return Err(MidEdgeFault::Corner { node: own.middle, tet: own.tet, edge: own.edge });
    }
    let mut by_middle: Vec<(u32, [u32; 2])> =
        all.iter().map(|own| (own.middle, own.edge)).collect();
    by_middle.par_sort_unstable();
    if let Some(pair) = by_middle.windows(2).find(|pair| pair[0].0 == pair[1].0) {
        return Err(MidEdgeFault::TwoEdges { node: pair[0].0, edges: [pair[0].1, pair[1].1] });
    }
    Ok(all.into_iter().map(|own| (own.edge, own.middle)).unzip())
}

/// The elements of a mesh with its mid-edge nodes, none of which is folded.
///
/// Shapes: M × 10, corners 1 … 4, then the edges of [`EDGES`].
///
/// # Errors
/// [`MidEdgeFault::Folded`] naming the first element whose Jacobian determinant is not positive at one of
/// its points.
pub(super) fn ten_node_tets(mesh: &TetMesh) -> Result<Vec<[u32; 10]>, MidEdgeFault> {
    let joined = |(corners, middles): (&[u32; 4], &[u32; 6])| {
        let mut nodes = [0; 10];
        nodes[..4].copy_from_slice(corners);
        nodes[4..].copy_from_slice(middles);
        nodes
    };
    let tets: Vec<[u32; 10]> = mesh.tets().iter().zip(mesh.mid_edge_nodes()).map(joined).collect();
    for (tet, nodes) in tets.iter().enumerate() {
        let determinants = jacobians(&nodes.map(|n| mesh.vertices()[n as usize]));
        // A NaN is no volume either.
        if let Some(&determinant) = determinants.iter().find(|d| !(**d > 0.0 && d.is_finite())) {
            return Err(MidEdgeFault::Folded { tet, determinant });
        }
    }
    Ok(tets)
}
