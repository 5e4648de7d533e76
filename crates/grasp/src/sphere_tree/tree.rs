//! The sphere tree itself: flat arrays of spheres and of the surface vertices they enclose.

use nalgebra::{Point3, Vector3};

use crate::shape::Sphere;

/// Octree of bounding spheres over surface vertices, in the frame of the positions it was built on.
///
/// Nodes lie breadth first, so a node's children are contiguous and always behind it. Vertices lie
/// in Morton order, so every subtree owns one contiguous run of them.
///
/// The thesis tests vertices against *overlapping* spheres (Figure 4.8), which stores a vertex once
/// for every sphere it falls in. Here each vertex belongs to the one cube cell that holds it, and
/// the cell's sphere (4.3) encloses the cell: nothing is stored twice and nothing is missed.
/// A cell whose vertices all fall in one child is replaced by that child (no single-child chains).
/// Vertices that share a cell 21 levels down (coincident ones) share a leaf.
///
/// Invariants: each sphere encloses its vertices and the spheres of its children;
/// 1 ≤ leaf count ≤ vertex count; `children` ≤ 8, depth ≤ 22.
///
/// Source: thesis 4.3, Table 4.1.
#[derive(Clone, Debug, PartialEq)]
pub struct SphereTree {
    pub(super) nodes: Vec<TreeNode>,
    /// Mesh node in each slot.
    pub(super) vertices: Vec<u32>,
    /// Position of the vertex in each slot, as of the last build or refit.
    pub(super) points: Vec<Point3<f64>>,
    /// The leaves, with what it takes to carry their spheres along.
    pub(super) leaves: Vec<LeafRest>,
    /// The nodes that have children, ascending.
    pub(super) inner: Vec<u32>,
    /// Search cost measure right after the build and now (see `SphereTree::quality`).
    pub(super) cost_built: f64,
    pub(super) cost: f64,
}

/// One sphere with the run of children and the run of vertex slots below it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct TreeNode {
    pub(super) sphere: Sphere,
    pub(super) first_child: u32,
    /// 0 for a leaf.
    pub(super) children: u32,
    pub(super) first_slot: u32,
    pub(super) slots: u32,
}

/// A leaf's sphere relative to its first vertex, fixed when the tree is built.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct LeafRest {
    pub(super) node: u32,
    pub(super) first_slot: u32,
    pub(super) slots: u32,
    pub(super) centre_from_vertex: Vector3<f64>,
    pub(super) radius: f64,
}

/// Why a tree cannot be built or refitted, or normals not computed.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum TreeError {
    /// There is no surface vertex to enclose.
    #[error("a sphere tree needs at least one surface vertex")]
    NoVertices,
    /// More vertices than a tree can index.
    #[error("{count} surface vertices, but a sphere tree holds at most {limit}")]
    TooMany {
        /// Vertices given.
        count: usize,
        /// Largest number allowed.
        limit: usize,
    },
    /// A surface vertex is not among the positions.
    #[error("surface node {node} is not among the {node_count} positions (0-based)")]
    IndexOutOfRange {
        /// The offending node.
        node: u32,
        /// Positions given.
        node_count: usize,
    },
    /// A coordinate is NaN, infinite, or so large that its square is.
    #[error("node {node} has a coordinate that is not a finite number below 1e150")]
    NotFinite {
        /// The offending node.
        node: u32,
    },
}

impl SphereTree {
    /// Number of distinct surface vertices.
    pub fn vertex_count(&self) -> usize {
        self.vertices.len()
    }

    /// Number of spheres, leaves included.
    pub fn sphere_count(&self) -> usize {
        self.nodes.len()
    }

    /// Sphere at the root: encloses the whole surface.
    pub fn bounding_sphere(&self) -> Sphere {
        self.nodes[0].sphere
    }

    /// Mesh nodes of the surface vertices in Morton order (near in the list is near in space).
    pub fn vertices(&self) -> &[u32] {
        &self.vertices
    }

    /// The vertices below a node and where they are.
    pub(super) fn run(&self, node: &TreeNode) -> (&[u32], &[Point3<f64>]) {
        let slots = node.slot_range();
        (&self.vertices[slots.clone()], &self.points[slots])
    }
}

impl TreeNode {
    pub(super) fn is_leaf(&self) -> bool {
        self.children == 0
    }

    pub(super) fn child_range(&self) -> std::ops::Range<usize> {
        self.first_child as usize..(self.first_child + self.children) as usize
    }

    pub(super) fn slot_range(&self) -> std::ops::Range<usize> {
        self.first_slot as usize..(self.first_slot + self.slots) as usize
    }
}

/// Refuses positions that would poison distances: every `nodes` entry in range and finite.
pub(super) fn check_positions(positions: &[Point3<f64>], nodes: &[u32]) -> Result<(), TreeError> {
    let node_count = positions.len();
    for &node in nodes {
        let point =
            positions.get(node as usize).ok_or(TreeError::IndexOutOfRange { node, node_count })?;
        // False for NaN too.
        if !point.coords.iter().all(|c| c.abs() < COORDINATE_MAX) {
            return Err(TreeError::NotFinite { node });
        }
    }
    Ok(())
}

/// Larger coordinates overflow when squared.
const COORDINATE_MAX: f64 = 1e150;
