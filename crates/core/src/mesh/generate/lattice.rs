//! Body-centred cubic lattice of points and tetrahedra that the round objects are cut from.

use nalgebra::{Point3, Vector3};

/// A box of the lattice: corner points at `origin + spacing · (i, j, k)` and centre points half
/// a cell further on every axis.
///
/// Every corner of one kind is joined to its 6 neighbours of the same kind (long edges, `spacing`)
/// and 8 of the other kind (short edges, `spacing · √3/2`). All tetrahedra are alike: two opposite
/// long edges, one of each kind, and four short ones; dihedral angles 60° and 90°.
///
/// Frame: the object's. Units: m.
#[derive(Clone, Copy, Debug)]
pub(super) struct Lattice {
    origin: Point3<f64>,
    spacing: f64,
    /// Points of one kind along each axis, each ≥ 5.
    counts: [usize; 3],
}

impl Lattice {
    /// Lattice around the box `low`–`high`, with a layer of at least one cell to spare.
    ///
    /// `shift` moves the lattice, in cells, each in 0..1.
    pub(super) fn around(
        low: Point3<f64>,
        high: Point3<f64>,
        spacing: f64,
        shift: [f64; 3],
    ) -> Self {
        let origin = low - (Vector3::repeat(1.0) + Vector3::from(shift)) * spacing;
        let counts = [0, 1, 2].map(|d| ((high[d] - low[d]) / spacing).ceil() as usize + 4);
        Self { origin, spacing, counts }
    }

    /// Length of the long edges.
    pub(super) fn spacing(&self) -> f64 {
        self.spacing
    }

    /// Number of points of both kinds.
    pub(super) fn point_count(&self) -> usize {
        2 * self.kind_count()
    }

    fn kind_count(&self) -> usize {
        self.counts[0] * self.counts[1] * self.counts[2]
    }

    fn strides(&self) -> [usize; 3] {
        [1, self.counts[0], self.counts[0] * self.counts[1]]
    }

    /// Whether a point is of the second kind, a cell's centre.
    pub(super) fn is_centre(&self, point: usize) -> bool {
        point >= self.kind_count()
    }

    fn cell(&self, point: usize) -> [usize; 3] {
        let [nx, ny, _] = self.counts;
        let at = point % self.kind_count();
        [at % nx, at / nx % ny, at / (nx * ny)]
    }

    /// Coordinates of a point.
    pub(super) fn position(&self, point: usize) -> Point3<f64> {
        let half = if self.is_centre(point) { 0.5 } else { 0.0 };
        let steps = Vector3::from(self.cell(point).map(|i| i as f64 + half));
        self.origin + steps * self.spacing
    }

    /// Whether a point lies in the outermost layer, where not all neighbours exist.
    pub(super) fn is_border(&self, point: usize) -> bool {
        let cell = self.cell(point);
        (0..3).any(|d| cell[d] == 0 || cell[d] + 1 == self.counts[d])
    }

    /// 0 or 1, different for the two ends of every long edge.
    pub(super) fn parity(&self, point: usize) -> usize {
        self.cell(point).iter().sum::<usize>() % 2
    }

    /// The 14 neighbours of a point that is not on the border, and whether the edge is long.
    pub(super) fn neighbours(&self, point: usize) -> [(usize, bool); 14] {
        let strides = self.strides();
        let mut found = [(0, false); 14];
        for d in 0..3 {
            found[2 * d] = (point - strides[d], true);
            found[2 * d + 1] = (point + strides[d], true);
        }
        for octant in 0..8 {
            let step: usize = (0..3).filter(|d| octant >> d & 1 == 1).map(|d| strides[d]).sum();
            let other = if self.is_centre(point) {
                point - self.kind_count() + step
            } else {
                point + self.kind_count() - step
            };
            found[6 + octant] = (other, false);
        }
        found
    }

    /// Calls `visit` with the four corners of every tetrahedron around the long edges that start
    /// at a corner point off the border.
    pub(super) fn for_each_tet(&self, mut visit: impl FnMut([usize; 4])) {
        let strides = self.strides();
        for point in (0..self.kind_count()).filter(|p| !self.is_border(*p)) {
            for d in 0..3 {
                let (u, v) = (strides[(d + 1) % 3], strides[(d + 2) % 3]);
                let centre = point + self.kind_count();
                let ring = [centre, centre - u, centre - u - v, centre - v];
                for side in 0..4 {
                    visit([point, point + strides[d], ring[side], ring[(side + 1) % 4]]);
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::{Quality, TetMesh, signed_volume};

    #[test]
    fn tetrahedra_are_alike_and_fill_space() {
        let low = Point3::origin();
        let lattice = Lattice::around(low, low + Vector3::new(2.0, 1.0, 1.5), 0.5, [0.2, 0.0, 0.9]);
        let mut tets = Vec::new();
        lattice.for_each_tet(|corners| {
            let mut nodes = corners.map(|c| c as u32);
            if signed_volume(&corners.map(|c| lattice.position(c))) < 0.0 {
                nodes.swap(0, 1);
            }
            tets.push(nodes);
        });
        let vertices = (0..lattice.point_count()).map(|p| lattice.position(p)).collect();
        let inner = (0..lattice.point_count() / 2).filter(|p| !lattice.is_border(*p)).count();
        assert_eq!(tets.len(), 12 * inner);
        let mesh = TetMesh::try_new(vertices, tets, vec![]).unwrap();
        let quality = Quality::from_mesh(&mesh, 0);
        assert!((quality.dihedral_min.to_degrees() - 60.0).abs() < 1e-9);
        assert!((quality.dihedral_max.to_degrees() - 90.0).abs() < 1e-9);
        // Twelve tetrahedra a cell, each a twelfth of it.
        assert!((quality.volume - inner as f64 * 0.125).abs() < 1e-12);
    }

    #[test]
    fn neighbours_are_mutual_and_as_far_as_their_edge_says() {
        let low = Point3::origin();
        let lattice = Lattice::around(low, low + Vector3::repeat(3.0), 1.0, [0.5; 3]);
        for point in (0..lattice.point_count()).filter(|p| !lattice.is_border(*p)) {
            for (other, is_long) in lattice.neighbours(point) {
                let distance = (lattice.position(other) - lattice.position(point)).norm();
                let expected = if is_long { 1.0 } else { 0.75f64.sqrt() };
                assert!((distance - expected).abs() < 1e-12);
                assert!(!is_long || lattice.parity(other) != lattice.parity(point));
                if !lattice.is_border(other) {
                    assert!(lattice.neighbours(other).contains(&(point, is_long)));
                }
            }
        }
    }
}
