//! Checks the answer to a press: forces balance, nodes and masks have the prescribed displacements.

use softgrasp_core::solve::{Loads, Method};
use softgrasp_protocol::{Answer, Question};

use super::tips::Tips;
use crate::reference::error_rel;
use crate::report::{ReportError, check};

/// Error of an answer. All displacements are compared with a direct solve in which the held nodes
/// have the displacements of the answer; for masks, the forces that those nodes then need must be
/// the masks' own, shared out by weight, and their means must be as asked.
///
/// Shapes: `answer` with the displacements of all nodes and, for masks, their forces.
///
/// # Errors
/// [`ReportError::Wrong`] if the error of the answer is above `allowed`.
pub fn verify(
    tips: &Tips,
    question: &Question,
    answer: &Answer,
    allowed: f64,
) -> Result<f64, ReportError> {
    let model = tips.model()?;
    let u = answer.displacements.clone().into_f64();
    let mut pairs: Vec<(u32, f64)> = question.known.iter().map(|k| (k.dof, k.value)).collect();
    for (nodes, _) in question.masks.iter() {
        let of_node = |&n: &u32| (0..3).map(move |axis| (3 * n + axis as u32, axis));
        pairs.extend(
            nodes.iter().flat_map(|n| of_node(n).map(|(dof, axis)| (dof, u[*n as usize][axis]))),
        );
    }
    let known = model.known(pairs)?;
    let factored = model.factor(&known.dofs, Method::SparseCholesky, &mut |_| {})?;
    let loads = Loads { q_known: &known.q_known, ..Loads::default() };
    let solution = factored.solve(model.stiffness(), loads, &mut |_| {})?;
    let right = solution.displacement.iter().copied();
    let mut error = error_rel(u.iter().flatten().copied().zip(right));
    let mut expected = vec![0.0; 3 * model.mesh().node_count()];
    for ((nodes, weights), force) in question.masks.iter().zip(&answer.mask_forces) {
        for (node, weight) in nodes.iter().zip(weights) {
            for (axis, force) in force.iter().enumerate() {
                expected[3 * *node as usize + axis] += weight * force;
            }
        }
    }
    if !question.masks.is_empty() {
        let needed = known.dofs.iter().zip(&solution.reaction);
        let free = needed.filter(|(dof, _)| tips.fixed.binary_search(dof).is_err());
        error = error.max(error_rel(free.map(|(dof, f)| (*f, expected[*dof as usize]))));
    }
    for ((nodes, weights), q) in question.masks.iter().zip(&question.mask_displacements) {
        for axis in 0..3 {
            let entries = nodes.iter().zip(weights);
            let mean: f64 = entries.map(|(n, w)| w * u[*n as usize][axis]).sum();
            let largest = q.iter().fold(0.0f64, |m, q| m.max(q.abs()));
            error = error.max((mean - q[axis]).abs() / largest);
        }
    }
    check(|| format!("press on {} nodes", u.len()), error, allowed)?;
    Ok(error)
}
