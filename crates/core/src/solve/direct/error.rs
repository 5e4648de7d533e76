//! Errors of the direct methods.

use crate::solve::partition::AXIS_NAMES;
use crate::solve::{Method, Partition, Within};

/// Why there is no answer.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum SolveError {
    /// A pivot of `K11` was not positive. Whether a body is held at all is known before anything is
    /// factored ([`super::super::find_free_motion`]); here rounding was larger than the pivot.
    #[error("{method}: {}", no_pivot(*.method, *.node, *.axis))]
    NotPositiveDefinite {
        /// Method that found it.
        method: Method,
        /// Node of the pivot.
        node: usize,
        /// Axis of the pivot.
        axis: char,
    },
    /// A method without a factor of the kind that is made here.
    #[error("{method} has no factor of this kind")]
    NoSuchFactor {
        /// Method that was asked for.
        method: Method,
    },
    /// Memory for the factor could not be had.
    #[error("{method}: no memory for the factor of {unknown_dofs} unknowns")]
    OutOfMemory {
        /// Method that needs the memory.
        method: Method,
        /// Size of `K11`.
        unknown_dofs: usize,
    },
    /// The factor or inverse is larger than it may be.
    #[error(
        "{method}: the factor or inverse of {unknown_dofs} unknowns takes up to {needed} bytes while \
         it is made, and may take {limit}"
    )]
    OverLimit {
        /// Method that needs the memory.
        method: Method,
        /// Size of `K11`.
        unknown_dofs: usize,
        /// Bytes it would take at most.
        needed: u64,
        /// Bytes it may take.
        limit: u64,
    },
    /// Conjugate gradients came to a halt, or used up their steps, before there was an answer.
    #[error(
        "{method}: after {steps} steps the residual is {residual_rel:.1e} of the load and the \
         estimated error {error_estimate_rel:.1e} of the displacement, and {error_rel:.1e} is to be \
         reached; nearly incompressible materials, very flat elements and very different stiffnesses \
         are hard without a factor: use front or front-mixed, or allow a larger error"
    )]
    NotConverged {
        /// Method that was used.
        method: Method,
        /// Steps of conjugate gradients.
        steps: u32,
        /// `‖b − K11 x‖ / ‖b‖` reached.
        residual_rel: f64,
        /// Estimate of `‖error‖ / ‖x‖` reached.
        error_estimate_rel: f64,
        /// Estimate that would do.
        error_rel: f64,
    },
    /// The answer holds NaN or infinity.
    #[error(
        "{method}: the answer is not finite; the numbers of the mesh, the material or the known \
         displacements are too large or too small for double precision"
    )]
    NotFinite {
        /// Method that was used.
        method: Method,
    },
    /// Loads that do not fit the partition.
    #[error("{given} values for {expected} {what}")]
    LoadCount {
        /// Name of the list.
        what: &'static str,
        /// Values that were given.
        given: usize,
        /// Values that the partition has places for.
        expected: usize,
    },
}

impl SolveError {
    /// Refuses a factor or inverse of so many unknowns that needs more bytes than it may take.
    pub(super) fn check_limit(how: Within, needed: u64, unknown_dofs: usize) -> Result<(), Self> {
        let Within { method, limit } = how;
        match needed > limit {
            true => Err(Self::OverLimit { method, unknown_dofs, needed, limit }),
            false => Ok(()),
        }
    }

    /// A pivot that was not positive, at the node and axis of its row of `K11`.
    pub(super) fn not_positive(method: Method, partition: &Partition, row: usize) -> Self {
        let dof = partition.unknown().get(row).map_or(0, |&d| d as usize);
        let (node, axis) = (dof / 3, AXIS_NAMES[dof % 3]);
        Self::NotPositiveDefinite { method, node, axis }
    }
}

/// What a pivot lost in rounding says of the body, which is another thing than a free motion.
fn no_pivot(method: Method, node: usize, axis: char) -> String {
    let lost = format!("the pivot of node {node} axis {axis} is lost in the rounding of");
    if method.is_single() {
        return format!(
            "{lost} single precision, and there is no memory for a factor in double precision; \
             raise the memory limit, or hold the body at nodes further apart"
        );
    }
    format!(
        "{lost} double precision: what is known holds the body too weakly, or an element there is \
         degenerate; hold nodes further apart and not in line, or mend the mesh"
    )
}
