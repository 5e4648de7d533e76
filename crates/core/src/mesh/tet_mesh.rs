//! The tetrahedral mesh every other module works on (lists 1 and 2 of the thesis, Table 3.1).

use nalgebra::Point3;

/// Tetrahedral mesh: vertex coordinates, four corners per element, one region label per element.
///
/// Shapes: `vertices` N points; `tets` M × 4 indices into `vertices`; `regions` empty or M labels.
/// Units: the file's own, metres inside a running scene.
/// Invariant: every index is below N, every tetrahedron has positive signed volume
/// `det J / 6` (3.33), where row i of `J` is corner i − corner 4 (3.23).
///
/// Source: thesis Table 3.1.
///
/// ```
/// use nalgebra::Point3;
/// use softgrasp_core::TetMesh;
///
/// let corners = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
/// let corners = corners.map(Point3::from).to_vec();
/// let mesh = TetMesh::try_new(corners.clone(), vec![[1, 0, 2, 3]], vec![])?;
/// assert!((mesh.signed_volume(0) - 1.0 / 6.0).abs() < 1e-15);
/// // With its corners the other way round the element would be inside out.
/// assert!(TetMesh::try_new(corners, vec![[0, 1, 2, 3]], vec![]).is_err());
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TetMesh {
    vertices: Vec<Point3<f64>>,
    tets: Vec<[u32; 4]>,
    regions: Vec<u32>,
}

/// Why vertices and elements do not make a mesh that can be modelled.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum MeshError {
    /// An element refers to a vertex that is not there.
    #[error("tetrahedron {tet} refers to node {node}, but there are {node_count} nodes (0-based)")]
    IndexOutOfRange {
        /// Element index, from 0.
        tet: usize,
        /// The offending node index.
        node: u32,
        /// Number of vertices.
        node_count: usize,
    },
    /// An element's signed volume is not positive.
    #[error("tetrahedron {tet} has signed volume {volume:e}; it must be positive")]
    NotPositive {
        /// Element index, from 0.
        tet: usize,
        /// Signed volume of the element, m³.
        volume: f64,
    },
    /// A coordinate is NaN or infinite.
    #[error("node {node} has a coordinate that is not a finite number")]
    NotFinite {
        /// Node index, from 0.
        node: usize,
    },
    /// The label list has another length than the element list.
    #[error("{labels} region labels for {tets} tetrahedra")]
    RegionCount {
        /// Region labels that were given.
        labels: usize,
        /// Elements that were given.
        tets: usize,
    },
    /// There are no elements.
    #[error("the mesh has no tetrahedra")]
    Empty,
}

impl TetMesh {
    /// Checked constructor: indices in range, finite coordinates, positive volumes.
    ///
    /// Shapes: see [`TetMesh`]; pass an empty `regions` when there is one material only.
    ///
    /// # Errors
    /// [`MeshError`] names the first element or node that breaks the invariant.
    pub fn try_new(
        vertices: Vec<Point3<f64>>,
        tets: Vec<[u32; 4]>,
        regions: Vec<u32>,
    ) -> Result<Self, MeshError> {
        if tets.is_empty() {
            return Err(MeshError::Empty);
        }
        if !regions.is_empty() && regions.len() != tets.len() {
            return Err(MeshError::RegionCount { labels: regions.len(), tets: tets.len() });
        }
        if let Some(node) = vertices.iter().position(|p| !p.coords.iter().all(|c| c.is_finite())) {
            return Err(MeshError::NotFinite { node });
        }
        let mesh = Self { vertices, tets, regions };
        for (tet, corners) in mesh.tets.iter().enumerate() {
            if let Some(&node) = corners.iter().find(|&&n| n as usize >= mesh.vertices.len()) {
                let node_count = mesh.vertices.len();
                return Err(MeshError::IndexOutOfRange { tet, node, node_count });
            }
            let volume = mesh.signed_volume(tet);
            if !(volume > 0.0 && volume.is_finite()) {
                return Err(MeshError::NotPositive { tet, volume });
            }
        }
        Ok(mesh)
    }

    /// Vertex coordinates, in the order of the file.
    pub fn vertices(&self) -> &[Point3<f64>] {
        &self.vertices
    }

    /// Corner indices, four per element.
    pub fn tets(&self) -> &[[u32; 4]] {
        &self.tets
    }

    /// Region label per element; empty when the mesh has one region.
    pub fn regions(&self) -> &[u32] {
        &self.regions
    }

    /// Number of vertices, orphans included.
    pub fn node_count(&self) -> usize {
        self.vertices.len()
    }

    /// Corner coordinates of one element.
    pub fn corners(&self, tet: usize) -> [Point3<f64>; 4] {
        self.tets[tet].map(|n| self.vertices[n as usize])
    }

    /// Signed volume `det J / 6` of one element (3.33 without the absolute value).
    pub fn signed_volume(&self, tet: usize) -> f64 {
        signed_volume(&self.corners(tet))
    }

    /// For each vertex, whether some element uses it; orphans are `false`.
    pub fn used_nodes(&self) -> Vec<bool> {
        let mut used = vec![false; self.vertices.len()];
        for &n in self.tets.iter().flatten() {
            used[n as usize] = true;
        }
        used
    }

    /// Longest edge of the axis-aligned bounding box of the vertices that elements use.
    pub fn size(&self) -> f64 {
        let (low, high) = self.bounds();
        (high - low).max()
    }

    /// Corners of the axis-aligned bounding box of the vertices that elements use.
    pub fn bounds(&self) -> (Point3<f64>, Point3<f64>) {
        let mut low = Point3::from([f64::INFINITY; 3]);
        let mut high = Point3::from([f64::NEG_INFINITY; 3]);
        for &n in self.tets.iter().flatten() {
            low = low.inf(&self.vertices[n as usize]);
            high = high.sup(&self.vertices[n as usize]);
        }
        (low, high)
    }

    /// This mesh over moved vertices (keep shape, section 6.1.2).
    ///
    /// Shapes: `vertices` as many points as before.
    ///
    /// # Errors
    /// [`MeshError`] if a moved element is inverted or a coordinate is not finite.
    pub fn with_vertices(&self, vertices: Vec<Point3<f64>>) -> Result<Self, MeshError> {
        Self::try_new(vertices, self.tets.clone(), self.regions.clone())
    }
}

/// Signed volume of a tetrahedron, `(c1 − c4) · ((c2 − c4) × (c3 − c4)) / 6`.
///
/// Source: thesis (3.23), (3.33).
pub fn signed_volume(c: &[Point3<f64>; 4]) -> f64 {
    (c[0] - c[3]).dot(&(c[1] - c[3]).cross(&(c[2] - c[3]))) / 6.0
}

/// Elements around every node, as one list with borders.
pub(crate) struct Incidence {
    /// Borders: elements of node n are `tets[starts[n] .. starts[n + 1]]`.
    pub starts: Vec<usize>,
    pub tets: Vec<u32>,
}

impl Incidence {
    /// Lists the elements of K nodes around each of `node_count` nodes, ascending.
    pub fn new<const K: usize>(node_count: usize, tets: &[[u32; K]]) -> Self {
        let mut starts = vec![0; node_count + 1];
        for n in tets.iter().flatten() {
            starts[*n as usize + 1] += 1;
        }
        for n in 1..starts.len() {
            starts[n] += starts[n - 1];
        }
        let mut next = starts.clone();
        let mut listed = vec![0; K * tets.len()];
        for (t, corners) in (0u32..).zip(tets) {
            for n in corners {
                listed[next[*n as usize]] = t;
                next[*n as usize] += 1;
            }
        }
        Self { starts, tets: listed }
    }

    /// Elements around one node.
    pub fn tets(&self, node: u32) -> &[u32] {
        &self.tets[self.starts[node as usize]..self.starts[node as usize + 1]]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn unit_tet() -> Vec<Point3<f64>> {
        vec![
            Point3::new(1.0, 0.0, 0.0),
            Point3::new(0.0, 1.0, 0.0),
            Point3::new(0.0, 0.0, 1.0),
            Point3::origin(),
        ]
    }

    #[test]
    fn unit_tetrahedron_has_a_sixth() {
        let mesh = TetMesh::try_new(unit_tet(), vec![[0, 1, 2, 3]], vec![]).unwrap();
        assert!((mesh.signed_volume(0) - 1.0 / 6.0).abs() < 1e-16);
    }

    #[test]
    fn inverted_tetrahedron_is_refused_with_its_volume() {
        let error = TetMesh::try_new(unit_tet(), vec![[1, 0, 2, 3]], vec![]).unwrap_err();
        assert!(matches!(error, MeshError::NotPositive { tet: 0, volume } if volume < 0.0));
    }

    #[test]
    fn index_beyond_the_vertices_is_refused() {
        let error = TetMesh::try_new(unit_tet(), vec![[0, 1, 2, 4]], vec![]).unwrap_err();
        assert_eq!(error, MeshError::IndexOutOfRange { tet: 0, node: 4, node_count: 4 });
    }
}
