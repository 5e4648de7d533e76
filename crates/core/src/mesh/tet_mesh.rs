//! The tetrahedral mesh every other module works on (lists 1 and 2 of the thesis, Table 3.1).

use nalgebra::Point3;

/// Tetrahedral mesh: vertex coordinates, four corners per element, one region label per element, and
/// perhaps six mid-edge nodes per element.
///
/// Shapes: `vertices` N points; `tets` M × 4 indices into `vertices`; `regions` empty or M labels;
/// mid-edge nodes none or M × 6 indices into `vertices`, of the edges 12, 23, 13, 14, 24, 34.
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
    mid_edge: Vec<[u32; 6]>,
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
    /// The list of mid-edge nodes has another length than the element list.
    #[error("mid-edge nodes of {elements} elements for {tets} tetrahedra")]
    MidEdgeCount {
        /// Elements whose mid-edge nodes were given.
        elements: usize,
        /// Elements of the mesh.
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
        let mesh = Self { vertices, tets, regions, mid_edge: Vec::new() };
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

    /// This mesh with mid-edge nodes of its own, which are vertices of it; only ten-node elements look
    /// at them, and see there that they fit together.
    ///
    /// Shapes: `mid_edge` one entry per element, nodes of the edges 12, 23, 13, 14, 24, 34; or none.
    ///
    /// # Errors
    /// [`MeshError::MidEdgeCount`], and [`MeshError::IndexOutOfRange`] for a node that is not there.
    pub fn with_mid_edge_nodes(mut self, mid_edge: Vec<[u32; 6]>) -> Result<Self, MeshError> {
        let (elements, tets) = (mid_edge.len(), self.tets.len());
        if elements != 0 && elements != tets {
            return Err(MeshError::MidEdgeCount { elements, tets });
        }
        let node_count = self.vertices.len();
        for (tet, nodes) in mid_edge.iter().enumerate() {
            if let Some(&node) = nodes.iter().find(|&&n| n as usize >= node_count) {
                return Err(MeshError::IndexOutOfRange { tet, node, node_count });
            }
        }
        self.mid_edge = mid_edge;
        Ok(self)
    }

    /// This mesh by its corners alone; the mid-edge nodes stay as vertices that no element uses.
    pub fn without_mid_edge_nodes(mut self) -> Self {
        self.mid_edge = Vec::new();
        self
    }

    /// Mid-edge nodes of its own, of the edges 12, 23, 13, 14, 24, 34; empty when the mesh has none.
    pub fn mid_edge_nodes(&self) -> &[[u32; 6]] {
        &self.mid_edge
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

    /// For each vertex, whether some element uses it, as a corner or a mid-edge node; orphans are
    /// `false`.
    pub fn used_nodes(&self) -> Vec<bool> {
        let mut used = self.is_corner();
        for &n in self.mid_edge.iter().flatten() {
            used[n as usize] = true;
        }
        used
    }

    /// For each vertex, whether it is a corner of some element.
    pub fn is_corner(&self) -> Vec<bool> {
        let mut is_corner = vec![false; self.vertices.len()];
        for &n in self.tets.iter().flatten() {
            is_corner[n as usize] = true;
        }
        is_corner
    }

    /// Longest edge of the axis-aligned bounding box of the corners of elements.
    pub fn size(&self) -> f64 {
        let (low, high) = self.bounds();
        (high - low).max()
    }

    /// Corners of the axis-aligned bounding box of the corners of elements.
    pub fn bounds(&self) -> (Point3<f64>, Point3<f64>) {
        let mut low = Point3::from([f64::INFINITY; 3]);
        let mut high = Point3::from([f64::NEG_INFINITY; 3]);
        for &n in self.tets.iter().flatten() {
            low = low.inf(&self.vertices[n as usize]);
            high = high.sup(&self.vertices[n as usize]);
        }
        (low, high)
    }

    /// This mesh over moved vertices (keep shape, section 6.1.2), mid-edge nodes with it.
    ///
    /// Shapes: `vertices` as many points as before.
    ///
    /// # Errors
    /// [`MeshError`] if a moved element is inverted or a coordinate is not finite.
    pub fn with_vertices(&self, vertices: Vec<Point3<f64>>) -> Result<Self, MeshError> {
        let moved = Self::try_new(vertices, self.tets.clone(), self.regions.clone())?;
        moved.with_mid_edge_nodes(self.mid_edge.clone())
    }
}

/// Signed volume of a tetrahedron, `(c1 − c4) · ((c2 − c4) × (c3 − c4)) / 6`.
///
/// Source: thesis (3.23), (3.33).
pub fn signed_volume(c: &[Point3<f64>; 4]) -> f64 {
    (c[0] - c[3]).dot(&(c[1] - c[3]).cross(&(c[2] - c[3]))) / 6.0
}

/// Corners of a tetrahedron with its orientation turned round; twice turned they are as they were.
pub fn mirrored([a, b, c, d]: [u32; 4]) -> [u32; 4] {
    [a, b, d, c]
}

/// Mid-edge nodes of a [`mirrored`] tetrahedron: of its edges 12, 23, 13, 14, 24, 34.
pub fn mirrored_middles([e12, e23, e13, e14, e24, e34]: [u32; 6]) -> [u32; 6] {
    [e12, e24, e14, e13, e23, e34]
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
    fn mid_edge_nodes_are_used_and_must_be_there() {
        let mut vertices = unit_tet();
        vertices.extend([Point3::new(0.5, 0.5, 0.0), Point3::new(9.0, 9.0, 9.0)]);
        let mesh = TetMesh::try_new(vertices.clone(), vec![[0, 1, 2, 3]], vec![]).unwrap();
        let curved = mesh.clone().with_mid_edge_nodes(vec![[4; 6]]).unwrap();
        assert_eq!(curved.used_nodes(), [true, true, true, true, true, false]);
        assert_eq!(mesh.used_nodes(), curved.is_corner());
        assert_eq!(curved.with_vertices(vertices).unwrap(), curved);
        assert_eq!(curved.without_mid_edge_nodes(), mesh);
        let error = mesh.clone().with_mid_edge_nodes(vec![[4, 4, 6, 4, 4, 4]]).unwrap_err();
        assert_eq!(error, MeshError::IndexOutOfRange { tet: 0, node: 6, node_count: 6 });
        let error = mesh.with_mid_edge_nodes(vec![[4; 6]; 2]).unwrap_err();
        assert_eq!(error, MeshError::MidEdgeCount { elements: 2, tets: 1 });
    }

    #[test]
    fn index_beyond_the_vertices_is_refused() {
        let error = TetMesh::try_new(unit_tet(), vec![[0, 1, 2, 4]], vec![]).unwrap_err();
        assert_eq!(error, MeshError::IndexOutOfRange { tet: 0, node: 4, node_count: 4 });
    }
}
