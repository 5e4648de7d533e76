//! Chooses the number of a region in a written file: its label, where that is a number.

use crate::mesh::TetMesh;

/// Numbers of the regions of a mesh for a format that has only numbers for them.
///
/// Shapes: one per region.
pub(super) struct RegionNumbers {
    numbers: Vec<i64>,
    /// Whether the labels themselves are these numbers.
    pub(super) are_labels: bool,
}

impl RegionNumbers {
    /// The labels as numbers if each of them is one, else 0, 1, 2 ….
    ///
    /// Shapes: `labels` one per region, or empty where nothing is known of them.
    pub(super) fn new(mesh: &TetMesh, labels: &[String]) -> Self {
        let count = mesh.regions().iter().max().map_or(1, |&most| most as usize + 1);
        let parsed: Option<Vec<i64>> = labels.iter().map(|label| label.parse().ok()).collect();
        match parsed.filter(|numbers| numbers.len() >= count) {
            Some(numbers) => Self { numbers, are_labels: true },
            None => Self { numbers: (0..count as i64).collect(), are_labels: false },
        }
    }

    /// Number of a region.
    pub(super) fn of(&self, region: u32) -> i64 {
        self.numbers.get(region as usize).copied().unwrap_or(i64::from(region))
    }

    /// Whether all of them are above 0 and fit 32 bits, as Gmsh's tags do.
    pub(super) fn are_tags(&self) -> bool {
        self.numbers.iter().all(|&number| number > 0 && number <= i64::from(i32::MAX))
    }
}

/// Whether a format that has only numbers for regions keeps their labels.
pub fn keeps_labels(mesh: &TetMesh, labels: &[String]) -> bool {
    mesh.regions().is_empty() || RegionNumbers::new(mesh, labels).are_labels
}
