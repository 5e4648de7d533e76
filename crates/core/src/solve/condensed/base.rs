//! The base of a body, made once: held degrees of freedom, factor, motions without energy.

use std::sync::Arc;

use super::rigid::{Mode, Rigid};
use super::rounding::asymmetry;
use super::surface_columns::SurfaceNodes;
use crate::fem::Stiffness;
use crate::mesh::{Bodies, TetMesh};
use crate::solve::definite::{hold, motions};
use crate::solve::front::{FrontAnalysis, FrontError, FrontFactor};
use crate::solve::partition::AXIS_NAMES;
use crate::solve::worked_out::WorkedOut;
use crate::solve::zero_energy::RigidBodies;
use crate::solve::{Partition, PartitionError, Stage};

/// Base factor of one shape.
///
/// Shapes: 3N degrees of freedom; `modes` z columns of 3N numbers.
/// Units: stiffness N/m, modes 1.
pub struct Base {
    pub(super) stiffness: Arc<Stiffness>,
    pub(super) partition: Partition,
    pub(super) factor: FrontFactor<f64>,
    /// Degrees of freedom the scene fixes, ascending.
    pub(super) fixed: Vec<u32>,
    /// Degrees of freedom held in addition so that `K_B` is definite; as many as modes.
    pub(super) held: Vec<u32>,
    pub(super) modes: Vec<Mode>,
    /// Largest sum of absolute values in a row of `K`, N/m: a bound of its norm.
    pub(super) stiffest: f64,
    /// Bound on how far a symmetric matrix of entries of `K` is from its symmetric part, N/m.
    pub(super) asymmetry: f64,
    /// The nodes of the boundary surface.
    pub(super) surface: SurfaceNodes,
    /// The modes as one basis; `None` without modes or where the basis is not proven to be one.
    pub(super) rigid: Option<Rigid>,
    /// Skeel's condition number of `K_B`, once somebody has asked for it.
    pub(super) condition: WorkedOut<f64>,
    /// Lower bound of the smallest eigenvalue of `K_B`, once somebody has proven one.
    pub(super) eigenvalue_min: WorkedOut<Option<f64>>,
}

/// Why a shape cannot be condensed, or a question not be answered this way.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum CondensedError {
    /// Fixed degrees of freedom that do not fit.
    #[error(transparent)]
    Partition(#[from] PartitionError),
    /// A body of very many hinged parts.
    #[error("condensed: body {body} has too many hinged parts; use front")]
    Hinges {
        /// The body.
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
    /// No memory.
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
        /// The bound.
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
        /// Axis name.
        axis: char,
    },
    /// A mask of a node that is not there.
    #[error(
        "condensed: mask {mask} names node {node}, but the mesh has {node_count} nodes (0-based)"
    )]
    NoSuchNode {
        /// The mask, in the order given.
        mask: usize,
        /// The node.
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
    /// The answer is not finite.
    #[error("condensed: the answer is not finite; the known displacements are too large")]
    NotFinite,
}

impl Base {
    /// Chooses the base of a shape and factors it on the current rayon pool.
    ///
    /// Shapes: `rigid` that of `mesh` and `bodies`; `fixed` ascending degrees of freedom held at
    /// zero by the scene.
    ///
    /// # Errors
    /// [`CondensedError`].
    pub fn try_new(
        mesh: &TetMesh,
        bodies: &Bodies,
        rigid: &RigidBodies,
        stiffness: &Arc<Stiffness>,
        fixed: &[u32],
        on_stage: &mut dyn FnMut(Stage),
    ) -> Result<Self, CondensedError> {
        Self::try_within(mesh, bodies, rigid, stiffness, fixed, u64::MAX, on_stage)
    }

    /// Base whose factor may take so much memory only, which is looked at before it is allocated.
    ///
    /// Units: `limit` bytes.
    ///
    /// # Errors
    /// Those of [`Base::try_new`], and [`CondensedError::OverLimit`] with both numbers.
    pub fn try_within(
        mesh: &TetMesh,
        bodies: &Bodies,
        rigid: &RigidBodies,
        stiffness: &Arc<Stiffness>,
        fixed: &[u32],
        limit: u64,
        on_stage: &mut dyn FnMut(Stage),
    ) -> Result<Self, CondensedError> {
        let fields =
            motions(mesh, bodies, rigid, fixed).map_err(|body| CondensedError::Hinges { body })?;
        let held = hold(&fields, fixed);
        let mut known = [fixed, held.as_slice()].concat();
        known.sort_unstable();
        let partition = Partition::try_new(&mesh.used_nodes(), &known)?;
        on_stage(Stage::Order);
        let analysis = Arc::new(FrontAnalysis::new(stiffness, &partition));
        let needed = analysis.peak_bytes::<f64>() as u64;
        if needed > limit {
            return Err(CondensedError::OverLimit { needed, limit });
        }
        on_stage(Stage::Factor);
        let factor = FrontFactor::try_new(&analysis, stiffness)
            .map_err(|error| refuse(error, &partition))?;
        let modes: Vec<Mode> =
            fields.into_iter().map(|field| Mode::new(stiffness, field)).collect();
        let stiffest = stiffness.row_sum_max();
        let asymmetry = asymmetry(stiffness, stiffest);
        Ok(Self {
            stiffness: Arc::clone(stiffness),
            partition,
            factor,
            fixed: fixed.to_vec(),
            surface: SurfaceNodes::from_mesh(mesh),
            rigid: Rigid::new(&modes, &held, asymmetry),
            held,
            modes,
            stiffest,
            asymmetry,
            condition: WorkedOut::default(),
            eigenvalue_min: WorkedOut::default(),
        })
    }

    /// Number of degrees of freedom, orphans included.
    pub fn dof_count(&self) -> usize {
        self.partition.dof_count()
    }

    /// Degrees of freedom the scene fixes, ascending.
    pub fn fixed(&self) -> &[u32] {
        &self.fixed
    }

    /// Order and analysis of the factor, and of that of any matrix on its pattern.
    pub fn analysis(&self) -> &FrontAnalysis {
        self.factor.analysis()
    }

    /// Nodal forces `K u` (3.36) of a displacement field.
    ///
    /// Shapes: 3N. Units: m, N.
    pub fn forces_of(&self, displacement: &[f64]) -> Vec<f64> {
        self.stiffness.mul(displacement)
    }

    /// Whether the scene's fixed nodes hold every body.
    pub fn is_held_by_scene(&self) -> bool {
        self.held.is_empty()
    }

    /// Bytes that the proof of the smallest eigenvalue takes for the moment: a second factor.
    pub fn proof_bytes(&self) -> u64 {
        self.factor.analysis().peak_bytes::<f64>() as u64
    }

    /// Bytes of the factor and the modes.
    pub fn bytes(&self) -> usize {
        self.factor.bytes() + self.modes.len() * 8 * self.dof_count() + self.surface.bytes()
    }
}

pub(super) fn refuse(error: FrontError, partition: &Partition) -> CondensedError {
    match error {
        FrontError::NotPositive { row } => {
            let dof = partition.unknown().get(row).map_or(0, |&d| d as usize);
            CondensedError::NotPositiveDefinite { node: dof / 3, axis: AXIS_NAMES[dof % 3] }
        }
        FrontError::OutOfMemory { bytes } => CondensedError::OutOfMemory { bytes },
        // The analysis was made from this very stiffness.
        FrontError::OtherPattern => CondensedError::OutOfMemory { bytes: 0 },
    }
}
