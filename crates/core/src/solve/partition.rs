//! Boundary conditions: degrees of freedom split into unknown (1) and known (2), which have prescribed
//! displacements (Dirichlet values), as in thesis (3.41).

/// Prescribed displacements (Dirichlet values) `Q_k`, one value per degree of freedom, sorted by degree of freedom.
///
/// Units: m.
///
/// Source: thesis (3.41).
#[derive(Clone, Debug, Default, PartialEq)]
pub struct KnownDisplacements {
    dofs: Vec<u32>,
    values: Vec<f64>,
}

/// Known displacements that contradict each other or are not numbers.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum KnownError {
    /// One degree of freedom with two values.
    #[error("node {node} axis {axis} is given two displacements, {first} and {second}")]
    Contradiction {
        /// Node, from 0.
        node: usize,
        /// Axis name, `x`, `y` or `z`.
        axis: char,
        /// One of the prescribed displacements, m.
        first: f64,
        /// The other prescribed displacement, m.
        second: f64,
    },
    /// A prescribed displacement is NaN or infinite.
    #[error(
        "node {node} axis {axis} is given the displacement {value}, which is not a finite number"
    )]
    NotFinite {
        /// Node, from 0.
        node: usize,
        /// Axis of the degree of freedom: x, y or z.
        axis: char,
        /// The prescribed displacement.
        value: f64,
    },
}

pub(super) const AXIS_NAMES: [char; 3] = ['x', 'y', 'z'];

impl KnownDisplacements {
    /// Sorts `(dof, value)` pairs; equal repetitions are one, contradictions an error.
    ///
    /// Units: values m.
    ///
    /// # Errors
    /// [`KnownError`] names the node and axis.
    pub fn try_new(mut pairs: Vec<(u32, f64)>) -> Result<Self, KnownError> {
        pairs.sort_by_key(|&(dof, _)| dof);
        let mut known = Self::default();
        for (dof, value) in pairs {
            let (node, axis) = (dof as usize / 3, AXIS_NAMES[dof as usize % 3]);
            if !value.is_finite() {
                return Err(KnownError::NotFinite { node, axis, value });
            }
            if known.dofs.last() == Some(&dof) {
                let first = known.values[known.values.len() - 1];
                if first != value {
                    return Err(KnownError::Contradiction { node, axis, first, second: value });
                }
                continue;
            }
            known.dofs.push(dof);
            known.values.push(value);
        }
        Ok(known)
    }

    /// Known degrees of freedom, ascending.
    pub fn dofs(&self) -> &[u32] {
        &self.dofs
    }

    /// Their values, in the same order, m.
    pub fn values(&self) -> &[f64] {
        &self.values
    }
}

/// Which degrees of freedom are unknown, which known; those of orphan nodes are neither.
///
/// Shapes: `unknown.len() + known.len() ≤ 3N`.
///
/// Source: thesis (3.41).
#[derive(Clone, Debug, PartialEq)]
pub struct Partition {
    unknown: Vec<u32>,
    known: Vec<u32>,
    /// Position of a degree of freedom among the unknown, or `NOT_UNKNOWN`.
    position: Vec<u32>,
}

const NOT_UNKNOWN: u32 = u32::MAX;

/// Known degrees of freedom that do not fit the mesh.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum PartitionError {
    /// The mesh has no such degree of freedom.
    #[error("node {node} is given a displacement, but the mesh has {node_count} nodes (0-based)")]
    NoSuchNode {
        /// Node, from 0.
        node: usize,
        /// Number of nodes.
        node_count: usize,
    },
    /// The node is in no element.
    #[error(
        "node {node} is given a displacement, but no tetrahedron uses it, so nothing would move"
    )]
    Orphan {
        /// Node, from 0.
        node: usize,
    },
    /// The degrees of freedom are not ascending, or one stands twice.
    #[error("known degrees of freedom are not ascending at position {position}")]
    NotSorted {
        /// Position in the list.
        position: usize,
    },
}

impl Partition {
    /// Splits the degrees of freedom of a mesh.
    ///
    /// Shapes: `used` one flag per node ([`crate::mesh::TetMesh::used_nodes`]); `known` ascending.
    ///
    /// # Errors
    /// [`PartitionError`] names the node.
    ///
    /// Source: thesis (3.41).
    pub fn try_new(used: &[bool], known: &[u32]) -> Result<Self, PartitionError> {
        Self::check(used, known)?;
        let mut position = vec![NOT_UNKNOWN; 3 * used.len()];
        let mut unknown = Vec::with_capacity(3 * used.len() - known.len());
        let mut next_known = known.iter().peekable();
        for (node, _) in used.iter().enumerate().filter(|(_, u)| **u) {
            for dof in 3 * node as u32..3 * node as u32 + 3 {
                if next_known.next_if_eq(&&dof).is_none() {
                    position[dof as usize] = unknown.len() as u32;
                    unknown.push(dof);
                }
            }
        }
        Ok(Self { unknown, known: known.to_vec(), position })
    }

    /// Whether known degrees of freedom fit the mesh, without splitting them.
    ///
    /// Shapes and errors as for [`Partition::try_new`].
    pub fn check(used: &[bool], known: &[u32]) -> Result<(), PartitionError> {
        if let Some(position) = known.windows(2).position(|w| w[0] >= w[1]) {
            return Err(PartitionError::NotSorted { position: position + 1 });
        }
        for &dof in known {
            let node = dof as usize / 3;
            match used.get(node) {
                None => return Err(PartitionError::NoSuchNode { node, node_count: used.len() }),
                Some(false) => return Err(PartitionError::Orphan { node }),
                Some(true) => {}
            }
        }
        Ok(())
    }

    /// Unknown degrees of freedom, ascending.
    pub fn unknown(&self) -> &[u32] {
        &self.unknown
    }

    /// Writes the unknown displacements to their places among all.
    pub(super) fn scatter_unknown(&self, x: &[f64], q: &mut [f64]) {
        for (&dof, x) in self.unknown.iter().zip(x) {
            q[dof as usize] = *x;
        }
    }

    /// Known degrees of freedom, ascending.
    pub fn known(&self) -> &[u32] {
        &self.known
    }

    /// Number of degrees of freedom, those of orphan nodes included.
    pub fn dof_count(&self) -> usize {
        self.position.len()
    }

    /// Row of a degree of freedom in `K11`, if it is unknown.
    pub fn row_of(&self, dof: usize) -> Option<usize> {
        match self.position[dof] {
            NOT_UNKNOWN => None,
            row => Some(row as usize),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn contradicting_values_are_refused_and_equal_ones_merged() {
        let merged = KnownDisplacements::try_new(vec![(5, 2.0), (3, 1.0), (5, 2.0)]).unwrap();
        assert_eq!(merged.dofs(), [3, 5]);
        let error = KnownDisplacements::try_new(vec![(5, 2.0), (5, 2.5)]).unwrap_err();
        assert!(matches!(error, KnownError::Contradiction { node: 1, axis: 'z', .. }));
    }

    #[test]
    fn orphan_dofs_are_neither_known_nor_unknown() {
        let partition = Partition::try_new(&[true, false, true], &[1, 6, 7, 8]).unwrap();
        assert_eq!(partition.unknown(), [0, 2]);
        assert_eq!(partition.row_of(2), Some(1));
        assert_eq!(partition.row_of(4), None);
        let error = Partition::try_new(&[true, false], &[3]).unwrap_err();
        assert_eq!(error, PartitionError::Orphan { node: 1 });
    }
}
