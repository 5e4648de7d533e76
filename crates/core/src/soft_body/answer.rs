//! Displacements, reactions and their error, and why there are none.

use std::collections::BTreeMap;

use nalgebra::Vector3;

use crate::model::{Model, ModelError};
use crate::solve::condensed::CondensedError;
use crate::solve::equilibrium::NoEquilibrium;

/// Displacements under a load case.
///
/// Shapes: N nodes of the mesh. Units: m, N. Frame: that of the mesh.
#[derive(Clone, Debug, PartialEq)]
pub struct Answer {
    /// Displacement of every node; zero where no element uses the node.
    pub displacements: Vec<Vector3<f64>>,
    /// Force that holds each node with prescribed displacements, along the prescribed axes.
    pub reactions: BTreeMap<u32, Vector3<f64>>,
    /// Norm of the forces that are out of balance over that of the forces that act.
    pub residual_rel: f64,
    /// How far the displacements may be from the exact solution of the discrete equations.
    pub inexactness: Inexactness,
}

/// The error of displacements against the exact solution of the discrete equations, relative. That of
/// the mesh is not in it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Inexactness {
    /// Proven: the Euclidean norm of the error over that of the displacements is no larger
    /// (`docs/bound.md`).
    Proven(f64),
    /// Estimated: the largest error of a displacement over the largest displacement.
    Estimated(f64),
    /// Not known, and why.
    Unknown(&'static str),
}

/// An equilibrium at large deformation.
///
/// Units: J, 1.
#[derive(Clone, Debug, PartialEq)]
pub struct LargeAnswer {
    /// Displacements from the shape at rest, reactions, residual and error.
    pub answer: Answer,
    /// Stored elastic energy.
    pub energy: f64,
    /// Smallest ratio of an element's volume to that at rest.
    pub volume_ratio_min: f64,
    /// Whether the shape is not on the branch of equilibria that begins at rest, or not known to be.
    pub jumped: bool,
}

/// Why there is no answer.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum SoftBodyError {
    /// The model cannot be asked that.
    #[error(transparent)]
    Model(#[from] ModelError),
    /// The columns of the compliance give no answer.
    #[error(transparent)]
    Condensed(#[from] CondensedError),
    /// No equilibrium at large deformation.
    #[error(transparent)]
    Equilibrium(#[from] NoEquilibrium),
    /// A force on a node that nothing holds on to.
    #[error("a force acts on node {node}, which no element uses (0-based)")]
    LooseForce {
        /// Node, from 0.
        node: u32,
    },
    /// Force and displacement of one degree of freedom.
    #[error(
        "node {node} (0-based) has a force along an axis along which its displacement is prescribed; \
         one of both is unknown"
    )]
    ForceOnPrescribed {
        /// Node, from 0.
        node: u32,
    },
    /// Forces in a frame.
    #[error("frames take prescribed displacements only; use SoftBody::solve for forces")]
    ForceInFrame,
}

impl Inexactness {
    /// The number, whichever way it was found; infinity where it is not known.
    pub fn relative(&self) -> f64 {
        match self {
            Self::Proven(error) | Self::Estimated(error) => *error,
            Self::Unknown(_) => f64::INFINITY,
        }
    }
}

/// Displacements of the nodes of the mesh; those of mid-edge nodes come behind them.
pub(super) fn by_node(model: &Model, displacement: &[f64]) -> Vec<Vector3<f64>> {
    let nodes = displacement.as_chunks::<3>().0.iter().take(model.mesh().node_count());
    nodes.map(|u| Vector3::from(*u)).collect()
}

/// Reactions by node; zero along axes that are not prescribed.
pub(super) fn reactions(dofs: &[u32], forces: &[f64]) -> BTreeMap<u32, Vector3<f64>> {
    let mut reactions = BTreeMap::new();
    for (dof, force) in dofs.iter().zip(forces) {
        reactions.entry(dof / 3).or_insert_with(Vector3::zeros)[(dof % 3) as usize] = *force;
    }
    reactions
}
