//! Why a finite element model cannot be made or asked.

use crate::contact::MaskError;
use crate::fem::hyperelastic::YieldError;
use crate::fem::{AssemblyError, QuadraticMeshError, SpreadLoadError};
use crate::solve::condensed::CondensedError;
use crate::solve::equilibrium::Dependent;
use crate::solve::{FreeMotion, KnownError, PartitionError, SolveError};

/// Why a model cannot be made or asked.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ModelError {
    /// Material and regions do not fit.
    #[error(transparent)]
    Assembly(#[from] AssemblyError),
    /// Known displacements contradict each other.
    #[error(transparent)]
    Known(#[from] KnownError),
    /// Known degrees of freedom do not fit the mesh.
    #[error(transparent)]
    Partition(#[from] PartitionError),
    /// A rigid motion is not held back.
    #[error("{0}")]
    Free(FreeMotion),
    /// The method failed.
    #[error(transparent)]
    Solve(#[from] SolveError),
    /// The mesh has too many edges for mid-edge nodes, or its own do not fit together.
    #[error(transparent)]
    MidNodes(#[from] QuadraticMeshError),
    /// A node was named that the mesh does not have, as a mid-edge node that was made.
    #[error("node {node} is given a displacement, but the mesh has {node_count} nodes (0-based)")]
    NoSuchNode {
        /// Node, from 0.
        node: usize,
        /// Nodes of the mesh.
        node_count: usize,
    },
    /// A mask that does not fit the mesh.
    #[error("mask {mask} (from 0): {reason}")]
    Mask {
        /// Which one, in the order given.
        mask: usize,
        /// What is wrong with it.
        reason: MaskError,
    },
    /// The condensed engine does not know ten-node elements whose mid-edge nodes are not the mesh's own.
    #[error(
        "condensed works on linear tetrahedra, and on ten-node ones if the mesh has the mid-edge nodes; use \
         front for others"
    )]
    QuadraticCondensed,
    /// The condensed engine failed.
    #[error(transparent)]
    Condensed(#[from] CondensedError),
    /// Elements that cannot yield, or not so.
    #[error(transparent)]
    Yield(#[from] YieldError),
    /// A weight or a pressure that does not fit the body.
    #[error(transparent)]
    SpreadLoad(#[from] SpreadLoadError),
    /// A mask that says what is said already.
    #[error(transparent)]
    Dependent(#[from] Dependent),
}
