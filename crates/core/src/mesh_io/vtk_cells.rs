//! Cells of a VTK unstructured grid, the same in the legacy and the XML format.

use super::cell_kind::vtk_cell;
use super::cursor::Cursor;
use super::error::MeshFileError;
use super::raw_mesh::RawMesh;

/// Cells as three arrays: node indices one after another, where each cell ends, and its type.
#[derive(Debug, Default)]
pub(super) struct VtkCells {
    pub(super) connectivity: Vec<i64>,
    /// For each cell, the end of its nodes in `connectivity`.
    pub(super) ends: Vec<i64>,
    pub(super) types: Vec<i64>,
    /// Region label of each cell; empty when there are none.
    pub(super) regions: Vec<i64>,
}

impl VtkCells {
    /// Adds the cells to what was read; `first_node` is the index of the piece's first point.
    ///
    /// # Errors
    /// [`MeshFileError`] when the three arrays do not fit each other.
    pub(super) fn add_to(
        &self,
        raw: &mut RawMesh,
        first_node: usize,
        cursor: &Cursor,
    ) -> Result<(), MeshFileError> {
        if self.types.len() != self.ends.len() {
            let (expected, found) = (self.ends.len(), self.types.len());
            return Err(cursor.count_fault(
                "cell types",
                &expected.to_string(),
                &found.to_string(),
            ));
        }
        let mut start = 0_usize;
        let mut shifted = Vec::new();
        for (cell, (&end, &number)) in self.ends.iter().zip(&self.types).enumerate() {
            let end = usize::try_from(end).unwrap_or(usize::MAX);
            let Some(nodes) = self.connectivity.get(start..end) else {
                let expected = format!("{start} to {}", self.connectivity.len());
                let array = format!("offset of cell {cell} in connectivity");
                return Err(cursor.count_fault(&array, &expected, &end.to_string()));
            };
            start = end;
            let kind = vtk_cell(number, nodes.len());
            if number == 10 && nodes.len() != 4 {
                let array = format!("nodes of tetrahedron in cell {cell}");
                return Err(cursor.count_fault(&array, "4", &nodes.len().to_string()));
            }
            shifted.clear();
            shifted.extend(nodes.iter().map(|node| node.saturating_add(first_node as i64)));
            let region = self.regions.get(cell).copied().unwrap_or(0);
            raw.add_cell(kind, &shifted, [region, 0]);
        }
        if start != self.connectivity.len() {
            let found = self.connectivity.len().to_string();
            return Err(cursor.count_fault("connectivity", &start.to_string(), &found));
        }
        Ok(())
    }
}
