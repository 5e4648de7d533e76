//! The spheres of a sphere tree, and why there can be none.

use nalgebra::{Point3, Vector3};

use crate::shape::Sphere;

/// One sphere with the run of children and the run of vertex slots below it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct TreeNode {
    pub(super) sphere: Sphere,
    pub(super) first_child: u32,
    /// Number of children; 0 for a leaf.
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
    /// There are more vertices than a tree can index.
    #[error("{count} surface vertices, but a sphere tree holds at most {limit}")]
    TooMany {
        /// Number of vertices given.
        count: usize,
        /// Largest number of vertices that is allowed.
        limit: usize,
    },
    /// A surface vertex is not among the positions.
    #[error("surface node {node} is not among the {node_count} positions (0-based)")]
    IndexOutOfRange {
        /// Node that is not among the positions.
        node: u32,
        /// Number of positions given.
        node_count: usize,
    },
    /// A coordinate is NaN, infinite, or so large that its square is.
    #[error("node {node} has a coordinate that is not a finite number below 1e150")]
    NotFinite {
        /// Node with this coordinate.
        node: u32,
    },
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
