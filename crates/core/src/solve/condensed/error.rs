//! Why a body cannot be condensed, or a question not be answered this way.

use crate::solve::front::FrontError;
use crate::solve::partition::AXIS_NAMES;
use crate::solve::{Partition, PartitionError};

/// Why a shape cannot be condensed, or a question not be answered this way.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum CondensedError {
    /// Fixed degrees of freedom that do not fit.
    #[error(transparent)]
    Partition(#[from] PartitionError),
    /// A body of very many hinged parts.
    #[error("condensed: body {body} has too many hinged parts; use front")]
    Hinges {
        /// Index of the body, from 0.
        body: usize,
    },
    /// A pivot of `K_B` was not positive.
    #[error(
        "condensed: the stiffness is not positive definite at node {node} axis {axis}: an element \
         there is degenerate"
    )]
    NotPositiveDefinite {
        /// Node of the pivot.
        node: usize,
        /// Axis of the pivot.
        axis: char,
    },
    /// The base factor is larger than it may be.
    #[error(
        "condensed: the base factor takes up to {needed} bytes while it is made, and may take \
         {limit}; allow more memory, or use front-mixed, which takes half"
    )]
    OverLimit {
        /// Bytes it would take at most.
        needed: u64,
        /// Bytes it may take.
        limit: u64,
    },
    /// The system had no memory for the base factor.
    #[error("condensed: no memory for the base factor ({bytes} bytes)")]
    OutOfMemory {
        /// Bytes asked for.
        bytes: usize,
    },
    /// A contact set that alone is larger than the cache may be.
    #[error(
        "condensed: {contacts} touched nodes or masks need {needed} bytes of columns, more than the \
         cache bound of {bound}; raise the bound or, for nodes, use front"
    )]
    CacheTooSmall {
        /// Touched nodes and masks.
        contacts: usize,
        /// Bytes of their columns.
        needed: usize,
        /// Bytes that the cache may hold.
        bound: usize,
    },
    /// The touched nodes and masks leave a motion free.
    #[error("condensed: the touched nodes and masks do not hold the body")]
    NotHeld,
    /// The touched nodes and masks hold the body, but so weakly that rounding takes every digit.
    #[error(
        "condensed: the touched nodes and masks hold the body too weakly for double precision \
         (condition of the small system {condition:.0e}); hold nodes further apart and not in line, \
         or ask for front"
    )]
    HeldTooWeakly {
        /// Condition of the small system; infinite where it has no inverse.
        condition: f64,
    },
    /// A mask whose mean displacement follows from what else is held.
    #[error(
        "condensed: along {axis}, mask {mask} (from 0) says what other masks, touched nodes or fixed \
         nodes say already, so its force is not determined; leave it out or move it"
    )]
    Dependent {
        /// The mask, in the order given.
        mask: usize,
        /// Axis of the constraint: x, y or z.
        axis: char,
    },
    /// A mask of a node that is not there.
    #[error(
        "condensed: mask {mask} names node {node}, but the mesh has {node_count} nodes (0-based)"
    )]
    NoSuchNode {
        /// The mask, in the order given.
        mask: usize,
        /// The node, from 0.
        node: u32,
        /// Nodes of the mesh.
        node_count: usize,
    },
    /// A body that cannot fly: it is held, or it has parts that move on their own.
    #[error(
        "condensed: contact with friction takes one body that nothing holds, which has 6 motions \
         without energy; this one has {motions}"
    )]
    NotFree {
        /// Motions without energy.
        motions: usize,
    },
    /// Conjugate gradients, in the place of a factor of the base, did not come near the answer.
    #[error(
        "condensed: conjugate gradients end after {steps} steps with a residual of \
         {residual_rel:.0e} and an estimated error of {error_estimate_rel:.0e}; allow the memory of a \
         factor"
    )]
    NotConverged {
        /// Steps taken.
        steps: u32,
        /// Residual relative to the load.
        residual_rel: f64,
        /// Estimated error relative to the displacements.
        error_estimate_rel: f64,
    },
    /// Something that takes a factor of the base, which memory was too short for.
    #[error(
        "condensed: contact at large deformation takes a factor of the base, which does not fit the \
         memory; allow more, or ask for linear elasticity"
    )]
    NoFactor,
    /// The answer is not finite.
    #[error("condensed: the answer is not finite; the known displacements are too large")]
    NotFinite,
}

impl CondensedError {
    /// A factor of the base that failed.
    pub(super) fn of_factor(error: FrontError, partition: &Partition) -> Self {
        match error {
            FrontError::NotPositive { row } => {
                let dof = partition.unknown().get(row).map_or(0, |&d| d as usize);
                Self::NotPositiveDefinite { node: dof / 3, axis: AXIS_NAMES[dof % 3] }
            }
            FrontError::OutOfMemory { bytes } => Self::OutOfMemory { bytes },
            // The analysis was made from this very stiffness.
            FrontError::OtherPattern => Self::OutOfMemory { bytes: 0 },
        }
    }
}
