//! Derivatives of a quantity of displacements and reactions, by one more request with the same matrix.
//!
//! For a quantity J and `K u = f` the adjoint λ has the load ∂J/∂u where u is free and the displacement −∂J/∂R
//! where u is prescribed. With its reactions r, `∂J/∂f = λ` and `∂J/∂(prescribed u) = ∂J/∂u − r`.

use std::collections::BTreeMap;
use std::fmt::Write as _;

use softgrasp_protocol::{Answer, DofValue, NodeChoice, Question, SpreadLoads, Want};

/// A quantity J, told by its derivatives at an answer.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Quantity {
    /// By displacements, of each degree of freedom that is named.
    pub by_displacements: Vec<DofValue>,
    /// By reactions, of known degrees of freedom.
    pub by_reactions: Vec<DofValue>,
}

/// A quantity depends on the reaction of a degree of freedom that has none.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("node {node} has no reaction along axis {axis}: no displacement is prescribed there")]
pub struct NoReaction {
    /// Node, from 0.
    pub node: u32,
    /// Axis: 0, 1 or 2.
    pub axis: u32,
}

impl Quantity {
    /// The question whose answer has the derivatives.
    ///
    /// # Errors
    /// [`NoReaction`] that names the node.
    pub fn adjoint(&self, question: &Question) -> Result<Question, NoReaction> {
        let of_reactions: BTreeMap<u32, f64> =
            self.by_reactions.iter().map(|j| (j.dof, j.value)).collect();
        let is_known = |dof: &u32| question.known.iter().any(|known| known.dof == *dof);
        if let Some(dof) = of_reactions.keys().find(|dof| !is_known(dof)) {
            return Err(NoReaction { node: dof / 3, axis: dof % 3 });
        }
        let known: BTreeMap<u32, f64> = question
            .known
            .iter()
            .map(|known| (known.dof, -of_reactions.get(&known.dof).copied().unwrap_or(0.0)))
            .collect();
        let free = self.by_displacements.iter().filter(|j| !known.contains_key(&j.dof));
        Ok(Question {
            forces: free.copied().collect(),
            known: known.into_iter().map(|(dof, value)| DofValue { dof, value }).collect(),
            want: Want { nodes: NodeChoice::All, reactions: true, ..Want::default() },
            spread: SpreadLoads::default(),
            ..question.clone()
        })
    }

    /// Table of the derivatives of every node: `fx,fy,fz` by a force on it where it is free, `ux,uy,uz` by its
    /// displacement where that is prescribed; the other cells are empty.
    pub fn table(&self, adjoint: Answer) -> String {
        let slope: BTreeMap<u32, f64> =
            self.by_displacements.iter().map(|j| (j.dof, j.value)).collect();
        let held: BTreeMap<u32, f64> =
            adjoint.reactions.iter().map(|reaction| (reaction.dof, reaction.value)).collect();
        let mut table = "node,fx,fy,fz,ux,uy,uz\n".to_owned();
        for (node, lambda) in (0u32..).zip(adjoint.displacements.into_f64()) {
            let mut cells: [String; 6] = Default::default();
            for (axis, by_force) in (0..3).zip(lambda) {
                let dof = 3 * node + axis;
                match held.get(&dof) {
                    None => cells[axis as usize] = format!("{by_force:e}"),
                    Some(reaction) => {
                        let of_own = slope.get(&dof).copied().unwrap_or(0.0);
                        cells[3 + axis as usize] = format!("{:e}", of_own - reaction);
                    }
                }
            }
            // Writing to a String cannot fail.
            let _ = writeln!(table, "{node},{}", cells.join(","));
        }
        table
    }
}
