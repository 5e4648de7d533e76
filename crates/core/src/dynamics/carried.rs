//! What one step leaves for the next: displacements at its end, which the next one begins with.
//!
//! A state names its forces, and a step begins with the displacement that they give: a sum of as many
//! columns as nodes have a force, which are read from memory. A step that goes on where another one has
//! ended has that sum already, to the bit.

use super::state::ObjectState;
use crate::solve::condensed::{NodeForce, Response};

/// Displacements at the end of a step of linear elasticity, for a step that goes on from there.
#[derive(Debug, Default)]
pub struct Carried(Option<Ended>);

/// Nodes above which nothing is carried, as it would take more memory than a session should: 28 bytes each.
const NODES_MAX: usize = 1 << 15;

#[derive(Debug)]
struct Ended {
    nodes: Vec<u32>,
    /// Forces of the state.
    forces: Vec<NodeForce>,
    displacement: Vec<[f64; 3]>,
}

impl Carried {
    /// The displacement of some nodes that a step begins with. Nothing is carried afterwards.
    ///
    /// The columns of the state's forces have been asked for. Units: m. Frame: the object's.
    pub(super) fn begin(
        &mut self,
        response: &Response<'_>,
        state: &ObjectState,
        nodes: &[u32],
    ) -> Vec<[f64; 3]> {
        let is_there = |ended: &Ended| ended.nodes == nodes && ended.forces == state.forces;
        match self.0.take().filter(is_there) {
            Some(ended) => ended.displacement,
            None => response.displacement_of(nodes, &state.forces),
        }
    }

    /// Carries what a step has ended with.
    ///
    /// Shapes: `displacement` of `nodes`, under the forces of the state.
    pub(super) fn end(
        &mut self,
        state: &ObjectState,
        nodes: Vec<u32>,
        displacement: Vec<[f64; 3]>,
    ) {
        if nodes.len() <= NODES_MAX {
            self.0 = Some(Ended { nodes, forces: state.forces.clone(), displacement });
        }
    }
}
