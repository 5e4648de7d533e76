//! Where the entries of the global stiffness matrix are, known before any value is (thesis 3.5.2).

use rayon::prelude::*;

use crate::mesh::TetMesh;

/// Sparsity pattern of `kᵍ` by 3 × 3 node blocks, and for each block row the elements that add to
/// it, in element order: rows can be summed in parallel with the same bits on any thread count.
///
/// Shapes: N block rows; row n holds blocks `row_start[n] .. row_start[n + 1]`, their column nodes
/// ascending in `columns`. Orphan nodes have empty rows.
///
/// Source: thesis (3.46), section 3.5.2.
#[derive(Clone, Debug, PartialEq)]
pub struct StiffnessPattern {
    row_start: Vec<usize>,
    columns: Vec<u32>,
    /// Elements around node n: entries `around_start[n] .. around_start[n + 1]`.
    around_start: Vec<usize>,
    around: Vec<Around>,
}

/// One element seen from one of its nodes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Around {
    /// Element index.
    pub tet: u32,
    /// Which corner the row's node is.
    pub corner: u8,
    /// Position in the row of the blocks of corners 1 … 4.
    pub slots: [u32; 4],
}

impl StiffnessPattern {
    /// Pattern of a mesh.
    ///
    /// Shapes: N nodes give N block rows.
    pub fn new(mesh: &TetMesh) -> Self {
        let (around_start, tets_around) = elements_around(mesh);
        let rows: Vec<(Vec<u32>, Vec<Around>)> = (0..mesh.node_count())
            .into_par_iter()
            .map(|node| {
                let tets = &tets_around[around_start[node]..around_start[node + 1]];
                block_row(mesh, node as u32, tets)
            })
            .collect();
        let mut row_start = Vec::with_capacity(rows.len() + 1);
        row_start.push(0);
        let mut columns = Vec::with_capacity(rows.iter().map(|(c, _)| c.len()).sum());
        let mut around = Vec::with_capacity(tets_around.len());
        for (row_columns, row_around) in rows {
            columns.extend_from_slice(&row_columns);
            around.extend_from_slice(&row_around);
            row_start.push(columns.len());
        }
        Self { row_start, columns, around_start, around }
    }

    /// Number of nodes, orphans included.
    pub fn node_count(&self) -> usize {
        self.row_start.len() - 1
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

    pub(super) fn around(&self, node: usize) -> &[Around] {
        &self.around[self.around_start[node]..self.around_start[node + 1]]
    }
}

/// For each node the elements that use it, in element order (counting sort).
fn elements_around(mesh: &TetMesh) -> (Vec<usize>, Vec<u32>) {
    let mut start = vec![0usize; mesh.node_count() + 1];
    for &n in mesh.tets().iter().flatten() {
        start[n as usize + 1] += 1;
    }
    for n in 0..mesh.node_count() {
        start[n + 1] += start[n];
    }
    let mut next = start.clone();
    let mut tets = vec![0u32; 4 * mesh.tets().len()];
    for (tet, corners) in mesh.tets().iter().enumerate() {
        for &n in corners {
            tets[next[n as usize]] = tet as u32;
            next[n as usize] += 1;
        }
    }
    (start, tets)
}

/// Columns and contributing elements of one block row.
fn block_row(mesh: &TetMesh, node: u32, tets: &[u32]) -> (Vec<u32>, Vec<Around>) {
    let mut columns: Vec<u32> =
        tets.iter().flat_map(|&t| mesh.tets()[t as usize].iter().copied()).collect();
    columns.sort_unstable();
    columns.dedup();
    let slot = |n: u32| columns.partition_point(|&c| c < n) as u32;
    let around = tets
        .iter()
        .flat_map(|&tet| {
            let corners = mesh.tets()[tet as usize];
            let slots = corners.map(slot);
            // An element that names a node twice would be flat, so one corner matches; still,
            // every matching corner is taken so that no contribution could be lost.
            (0..4u8).filter(move |&c| corners[c as usize] == node).map(move |corner| Around {
                tet,
                corner,
                slots,
            })
        })
        .collect();
    (columns, around)
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
}
