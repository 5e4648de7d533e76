//! Reserves memory for a request: by the prediction from the mesh's size before anything is made, and by
//! the count before a factor is made.

use softgrasp_core::fem::Element;
use softgrasp_core::model::{Model, ModelError};
use softgrasp_core::solve::memory::{Need, Problem};
use softgrasp_core::solve::work::MeshSize;
use softgrasp_core::solve::{Analysed, Method};
use softgrasp_protocol::{MeshData, ModelHash};

use super::shortage::Shortage;
use crate::budget::Reservation;
use crate::machine_memory::available_bytes;
use crate::store::ModelStore;

/// Problem that memory is reserved for.
#[derive(Clone, Copy)]
pub(crate) struct Subject {
    pub problem: Problem,
    pub unknown_dofs: usize,
    /// A kept model that must not be dropped to make room; its bytes are those of the need.
    pub kept: Option<ModelHash>,
}

impl Subject {
    /// Subject of a request with its own mesh.
    pub fn once(mesh: &MeshData, known_dofs: usize) -> Self {
        let size = size_of(mesh);
        let unknown_dofs = (3 * size.nodes).saturating_sub(known_dofs);
        Self { problem: Problem { size, known_dofs }, unknown_dofs, kept: None }
    }

    /// Subject of a request about a model that is there.
    pub fn about(model: &Model, known_dofs: usize, kept: Option<ModelHash>) -> Self {
        let nodes = model.mesh().is_corner().iter().filter(|is_corner| **is_corner).count();
        let size = MeshSize { nodes, tets: model.mesh().tets().len() };
        let unknown_dofs = model.modelled_dofs().saturating_sub(known_dofs);
        Self { problem: Problem { size, known_dofs }, unknown_dofs, kept }
    }

    /// Memory that each of some methods is predicted to need.
    pub fn predict(&self, element: Element, methods: &[Method]) -> Vec<Need> {
        methods.iter().map(|&method| Need::predicted(self.problem, element, method)).collect()
    }
}

/// Reserves memory for the first of some needs that fits. To make room, drops kept data that is unused
/// for longest. A prediction is refused only if the least that it can be is too much.
///
/// # Errors
/// [`Shortage`] if none fits.
pub(crate) fn admit(
    models: &ModelStore,
    reservation: &Reservation,
    needs: &[Need],
    subject: &Subject,
) -> Result<Need, Box<Shortage>> {
    let available = available_bytes();
    let is_there = |need: &Need| available.is_none_or(|there| need.factor_bytes_min <= there);
    let mut is_machine = false;
    for need in needs {
        let (own, held) = match subject.kept {
            None => (need.bytes_min(), 0),
            Some(_) => (need.factor_bytes_min, need.model_bytes),
        };
        if !is_there(need) {
            is_machine = true;
        } else if reservation.reserve(own, held) {
            models.make_room(subject.kept);
            return Ok(*need);
        }
    }
    Err(shortage(reservation, needs, subject, available.filter(|_| is_machine)))
}

/// The shortage; `available` is the machine's free memory in bytes, if that is what does not suffice.
pub(crate) fn shortage(
    reservation: &Reservation,
    asked: &[Need],
    subject: &Subject,
    available: Option<u64>,
) -> Box<Shortage> {
    let limits = (reservation.limit(), reservation.of_others());
    Box::new(Shortage::new(asked, subject.problem, subject.unknown_dofs, limits, available))
}

/// Memory that a factor over fronts needs, once its pattern is analysed; `held`: bytes that the model
/// holds.
pub(crate) fn counted(model: &Model, held: u64, analysed: &Analysed, method: Method) -> Need {
    let blocks = model.stiffness().pattern().block_count();
    Need::counted(model.element(), method, held, blocks, analysed.analysis())
}

/// Number of nodes that elements use, and of elements; indices out of range are refused elsewhere.
fn size_of(mesh: &MeshData) -> MeshSize {
    let mut used = vec![false; mesh.vertices.len()];
    for &node in mesh.tets.iter().flatten() {
        if let Some(used) = used.get_mut(node as usize) {
            *used = true;
        }
    }
    MeshSize { nodes: used.iter().filter(|used| **used).count(), tets: mesh.tets.len() }
}

/// Why a question cannot be answered as it was asked.
#[derive(Debug, thiserror::Error)]
pub(crate) enum PlanError {
    #[error("node {node} is fixed by the model and moved by the question; use front or auto")]
    FixedMoved { node: u32 },
    #[error("{method} does not answer masks; ask for condensed or auto")]
    MasksDirect { method: softgrasp_core::solve::Method },
    #[error("masks are answered by condensed only, and not here: {0}")]
    MasksNotCondensed(Box<PlanError>),
    #[error("{0}")]
    Memory(Box<Shortage>),
    #[error(transparent)]
    Model(#[from] ModelError),
}
