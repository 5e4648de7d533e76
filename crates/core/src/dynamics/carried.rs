//! What one step leaves for the next: displacements at its end, which the next one begins with.
//!
//! A state names its forces, and a step begins with the displacement that they give: a sum of as many
//! columns as nodes have a force, which are read from memory. A step that goes on where another one has
//! ended has that sum already. It differs from one made anew by rounding and no more: what is left of the
//! shape before shrinks from step to step, and its rounding with it.

use super::near::NodeField;
use super::state::ObjectState;
use super::step::ContactStep;
use crate::solve::condensed::{NodeForce, Response};

/// Displacements at the end of a step of linear elasticity, for a step that goes on from there.
#[derive(Debug, Default)]
pub struct Carried(Option<Ended>);

/// Nodes above which nothing is carried, as it would take more memory than a session should: 48 bytes each.
const NODES_MAX: usize = 1 << 16;

#[derive(Debug)]
struct Ended {
    /// The nodes with a displacement, and the forces of the state.
    nodes: Vec<u32>,
    forces: Vec<NodeForce>,
    displacement: Vec<[f64; 3]>,
    pressed: Pressed,
}

/// Contact forces at nodes, and the displacement that they alone would give.
#[derive(Debug)]
pub(super) struct Pressed {
    pub forces: Vec<NodeForce>,
    pub displacement: Vec<[f64; 3]>,
}

impl Pressed {
    /// The displacement of some nodes under contact forces whose columns have been asked for.
    pub fn of(response: &Response<'_>, nodes: &[u32], forces: &[NodeForce]) -> Self {
        let [displacement] = response.moved_of(nodes, [forces]);
        Self { forces: forces.to_vec(), displacement }
    }
}

impl Carried {
    /// The displacement that a step begins with, and the one that some contacts alone would give: those it
    /// begins with, or those that gave way to them. Nothing is carried afterwards.
    ///
    /// Shapes: `nodes` some to displace. The columns of all forces have been asked for. Units: N, m.
    pub(super) fn begin(
        &mut self,
        (step, response): (&ContactStep<'_>, &Response<'_>),
        (state, held): (&ObjectState, Vec<NodeForce>),
        nodes: &[u32],
    ) -> (NodeField, Option<Pressed>) {
        let is_there = |ended: &Ended| ended.nodes == nodes && ended.forces == state.forces;
        let (begun, pressed) = match self.0.take().filter(is_there) {
            Some(ended) => (ended.displacement, ended.pressed),
            None => {
                let [begun, displacement] = response.moved_of(nodes, [&state.forces, &held]);
                (begun, Pressed { forces: held, displacement })
            }
        };
        (NodeField::new(nodes, begun, step.vertices.len()), Some(pressed))
    }

    /// Carries what a step has ended with.
    ///
    /// Shapes: `displacement` of `nodes`.
    pub(super) fn end(
        &mut self,
        (state, pressed): (&ObjectState, Pressed),
        nodes: Vec<u32>,
        displacement: Vec<[f64; 3]>,
    ) {
        if nodes.len() <= NODES_MAX {
            self.0 = Some(Ended { nodes, forces: state.forces.clone(), displacement, pressed });
        }
    }
}
