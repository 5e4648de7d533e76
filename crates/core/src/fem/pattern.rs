//! The sparsity pattern of the global stiffness matrix (thesis 3.5.2).

use nalgebra::Point3;
use rayon::prelude::*;

use super::{NodalPatches, QuadraticMesh};
use crate::mesh::{Incidence, TetMesh};

/// Sparsity pattern of `kᵍ` by 3 × 3 node blocks, and for each block row the elements that add to
/// it, in element order: rows can be summed in parallel with the same bits on any thread count.
///
/// Shapes: N block rows; row n holds blocks `row_start[n] .. row_start[n + 1]`, their column nodes
/// ascending in `columns`. Orphan nodes have empty rows. Elements have all four or all ten nodes.
///
/// Source: thesis (3.46), section 3.5.2.
#[derive(Clone, Debug, PartialEq)]
pub struct StiffnessPattern {
    row_start: Vec<usize>,
    columns: Vec<u32>,
    /// Elements around node n: entries `around_start[n] .. around_start[n + 1]`.
    around_start: Vec<usize>,
    around: Vec<Around>,
    /// For each entry of `around`, the positions in the row of the blocks of the element's nodes.
    slots: Vec<u32>,
    nodes_per_tet: usize,
    /// Where the nodes are at rest: orders are found by planes between them.
    places: Vec<Point3<f64>>,
}

/// One element seen from one of its nodes.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Around {
    /// Index of the element, from 0.
    tet: u32,
    /// Which of the element's nodes the row's node is.
    local: u8,
}

/// One element that adds to a block row.
#[derive(Clone, Copy, Debug)]
pub(super) struct Contribution<'a, const K: usize> {
    /// Index of the element, from 0.
    pub tet: usize,
    /// Which of the element's nodes the row's node is, from 0.
    pub local: usize,
    /// Position in the row of the blocks of the element's nodes 1 … K.
    pub slots: &'a [u32; K],
}

impl StiffnessPattern {
    /// Pattern of a linear mesh.
    ///
    /// Shapes: N nodes give N block rows.
    pub fn new(mesh: &TetMesh) -> Self {
        Self::from_elements(mesh.vertices(), mesh.tets(), None)
    }

    /// Pattern of a linear mesh with averaged nodal pressure: nodes of one patch see each other, so a
    /// row reaches as far as two elements.
    ///
    /// Shapes: N nodes give N block rows.
    pub fn nodal_pressure(mesh: &TetMesh, patches: &NodalPatches) -> Self {
        Self::from_elements(mesh.vertices(), mesh.tets(), Some(patches))
    }

    /// Pattern of a ten-node mesh.
    ///
    /// Shapes: N + E nodes give as many block rows.
    pub fn quadratic(mesh: &QuadraticMesh) -> Self {
        Self::from_elements(mesh.vertices(), mesh.tets(), None)
    }

    /// Pattern of elements of K nodes each; every node index must be one of `places`.
    fn from_elements<const K: usize>(
        places: &[Point3<f64>],
        tets: &[[u32; K]],
        patches: Option<&NodalPatches>,
    ) -> Self {
        let node_count = places.len();
        let Incidence { starts: around_start, tets: tets_around } =
            Incidence::new(node_count, tets);
        let rows: Vec<BlockRow> = (0..node_count)
            .into_par_iter()
            .with_min_len(64)
            .map(|node| {
                let around = &tets_around[around_start[node]..around_start[node + 1]];
                let patches = patches.into_iter().flat_map(|p| p.of_node(node));
                let further = patches.flat_map(|patch| patch.nodes.iter().copied());
                block_row(tets, node as u32, around, further)
            })
            .collect();
        let mut row_start = Vec::with_capacity(rows.len() + 1);
        row_start.push(0);
        let mut columns = Vec::with_capacity(rows.iter().map(|row| row.columns.len()).sum());
        let mut around = Vec::with_capacity(tets_around.len());
        let mut slots = Vec::with_capacity(K * tets_around.len());
        for row in rows {
            columns.extend_from_slice(&row.columns);
            around.extend_from_slice(&row.around);
            slots.extend_from_slice(&row.slots);
            row_start.push(columns.len());
        }
        let places = places.to_vec();
        Self { row_start, columns, around_start, around, slots, nodes_per_tet: K, places }
    }

    /// Number of nodes, orphans included.
    pub fn node_count(&self) -> usize {
        self.row_start.len() - 1
    }

    /// Nodes of each element: 4 or 10.
    pub fn nodes_per_tet(&self) -> usize {
        self.nodes_per_tet
    }

    /// Where the nodes are at rest, m.
    pub fn places(&self) -> &[Point3<f64>] {
        &self.places
    }

    /// Number of stored 3 × 3 blocks.
    pub fn block_count(&self) -> usize {
        self.columns.len()
    }

    /// Range of block indices of one row.
    pub fn row(&self, node: usize) -> std::ops::Range<usize> {
        self.row_start[node]..self.row_start[node + 1]
    }

    /// Column nodes of one block row, ascending.
    pub fn columns(&self, node: usize) -> &[u32] {
        &self.columns[self.row(node)]
    }

    /// Elements that add to one block row, in element order; K must be [`Self::nodes_per_tet`].
    pub(super) fn around<const K: usize>(
        &self,
        node: usize,
    ) -> impl Iterator<Item = Contribution<'_, K>> {
        let range = self.around_start[node]..self.around_start[node + 1];
        let slots = &self.slots.as_chunks::<K>().0[range.clone()];
        self.around[range].iter().zip(slots).map(|(around, slots)| Contribution {
            tet: around.tet as usize,
            local: around.local as usize,
            slots,
        })
    }
}

/// Columns and contributing elements of one block row.
struct BlockRow {
    columns: Vec<u32>,
    around: Vec<Around>,
    slots: Vec<u32>,
}

fn block_row<const K: usize>(
    tets: &[[u32; K]],
    node: u32,
    tets_around: &[u32],
    further: impl Iterator<Item = u32>,
) -> BlockRow {
    let mut columns: Vec<u32> = tets_around.iter().flat_map(|&t| tets[t as usize]).collect();
    columns.extend(further);
    columns.sort_unstable();
    columns.dedup();
    let mut around = Vec::with_capacity(tets_around.len());
    let mut slots = Vec::with_capacity(K * tets_around.len());
    for &tet in tets_around {
        let nodes = tets[tet as usize];
        // An element that names a node twice would be flat, so one local node matches; still,
        // every match is taken so that no contribution could be lost.
        for local in (0..K as u8).filter(|&local| nodes[local as usize] == node) {
            around.push(Around { tet, local });
            slots.extend(nodes.map(|n| columns.partition_point(|&c| c < n) as u32));
        }
    }
    BlockRow { columns, around, slots }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Point3;

    #[test]
    fn orphan_rows_are_empty_and_columns_ascend() {
        let vertices =
            [[1.0, 0.0, 0.0], [9.0, 9.0, 9.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [0.0; 3]]
                .map(Point3::from);
        let mesh = TetMesh::try_new(vertices.to_vec(), vec![[0, 2, 3, 4]], vec![]).unwrap();
        let pattern = StiffnessPattern::new(&mesh);
        assert!(pattern.columns(1).is_empty());
        assert_eq!(pattern.columns(3), [0, 2, 3, 4]);
        assert_eq!(pattern.block_count(), 16);
    }

    #[test]
    fn ten_node_rows_couple_exactly_the_nodes_that_share_an_element() {
        let linear = crate::mesh::generate(crate::mesh::BuiltIn::Sphere, 100).unwrap();
        let mesh = QuadraticMesh::try_new(&linear).unwrap();
        let pattern = StiffnessPattern::quadratic(&mesh);
        let mut expected = vec![std::collections::BTreeSet::<u32>::new(); mesh.node_count()];
        for tet in mesh.tets() {
            for &row in tet {
                expected[row as usize].extend(tet);
            }
        }
        assert_eq!(pattern.nodes_per_tet(), 10);
        for (node, columns) in expected.iter().enumerate() {
            assert!(pattern.columns(node).iter().eq(columns), "node {node}");
            for c in pattern.around::<10>(node) {
                assert_eq!(mesh.tets()[c.tet][c.local], node as u32);
                for (slot, &column) in c.slots.iter().zip(&mesh.tets()[c.tet]) {
                    assert_eq!(pattern.columns(node)[*slot as usize], column);
                }
            }
        }
    }
}
