//! Checks the nodes, forces and masks that a question names, before anything costly is done.

use softgrasp_core::contact::Mask;
use softgrasp_core::model::{Known, Model};
use softgrasp_protocol::{DofValue, NodeChoice, Question, Want};

use crate::refusal::Refusal;

/// Largest number of unknown forces of a question with masks; above it the small system is too large, and
/// no other method answers.
const MASK_FORCES_MAX: usize = 600;

/// Known displacements as pairs of degree of freedom and value, m.
pub(crate) fn pairs(known: &[DofValue]) -> Vec<(u32, f64)> {
    known.iter().map(|k| (k.dof, k.value)).collect()
}

/// Nodes of a mask, each with its weight.
pub(crate) fn paired((nodes, weights): (&[u32], &[f64])) -> Vec<(u32, f64)> {
    nodes.iter().copied().zip(weights.iter().copied()).collect()
}

/// Masks of the question and their displacements (three each, m), checked against the model.
pub(crate) fn checked_masks(
    model: &Model,
    question: &Question,
) -> Result<(Vec<Mask>, Vec<f64>), Refusal> {
    let q = question.mask_displacements.as_flattened();
    if let Some(at) = q.iter().position(|value| !value.is_finite()) {
        return Err(Refusal::MaskNotFinite { mask: at / 3, value: q[at] });
    }
    let forces = q.len() + question.known.len();
    if !q.is_empty() && forces > MASK_FORCES_MAX {
        return Err(Refusal::TooManyTouched { forces, max: MASK_FORCES_MAX });
    }
    Ok((model.masks(question.masks.iter().map(paired))?, q.to_vec()))
}

/// Refuses wanted nodes that are not there.
///
/// # Errors
/// [`Refusal::NoSuchNode`].
pub(crate) fn check_nodes(want: &Want, node_count: usize) -> Result<(), Refusal> {
    let NodeChoice::Nodes(nodes) = &want.nodes else { return Ok(()) };
    match nodes.iter().find(|&&n| n as usize >= node_count) {
        Some(&node) => {
            Err(Refusal::NoSuchNode { what: "the list of wanted nodes", node, node_count })
        }
        None => Ok(()),
    }
}

/// Refuses forces on nodes that are not there, on known degrees of freedom, and that are no numbers.
///
/// # Errors
/// [`Refusal`] that names the node.
pub(super) fn check_forces(
    node_count: usize,
    known: &Known,
    forces: &[DofValue],
) -> Result<(), Refusal> {
    for &DofValue { dof, value } in forces {
        let node = dof / 3;
        if !value.is_finite() {
            return Err(Refusal::ForceNotFinite { node, value });
        }
        if value != 0.0 && known.dofs.binary_search(&dof).is_ok() {
            return Err(Refusal::ForceOnKnown { node });
        }
        if node as usize >= node_count {
            return Err(Refusal::NoSuchNode { what: "the list of forces", node, node_count });
        }
    }
    Ok(())
}

/// Forces by degree of freedom of the system, N; empty if the question has none.
///
/// # Errors
/// [`Refusal`] that names the node.
pub(crate) fn scatter_forces(
    (node_count, system_node_count): (usize, usize),
    known: &Known,
    forces: &[DofValue],
) -> Result<Vec<f64>, Refusal> {
    check_forces(node_count, known, forces)?;
    if forces.is_empty() {
        return Ok(Vec::new());
    }
    let mut scattered = vec![0.0; 3 * system_node_count];
    forces.iter().for_each(|force| scattered[force.dof as usize] += force.value);
    Ok(scattered)
}
