//! `K11` in blocks of three, as the finest level of a hierarchy sees it.

use super::block_rows::NodeMatrix;
use crate::fem::{AXES, Stiffness, dof};
use crate::solve::Partition;

/// The rows and columns of `K11` that belong to nodes with an unknown axis, scaled by a power of two
/// so that their diagonal is about one.
///
/// A known axis of such a node has a row and column of its own with its own stiffness on the
/// diagonal: where nothing is asked nothing moves.
pub(super) struct FineRows<'a> {
    stiffness: &'a Stiffness,
    partition: &'a Partition,
    /// Nodes with an unknown axis, ascending.
    nodes: Vec<u32>,
    /// Place of each node among those, or `NONE`.
    place: Vec<u32>,
    scale: f64,
}

/// A node without an unknown axis.
const NONE: u32 = u32::MAX;

impl<'a> FineRows<'a> {
    pub fn new(stiffness: &'a Stiffness, partition: &'a Partition) -> Self {
        let mut place = vec![NONE; stiffness.node_count()];
        let mut nodes: Vec<u32> = partition.unknown().iter().map(|d| d / AXES as u32).collect();
        nodes.dedup();
        for (k, &node) in nodes.iter().enumerate() {
            place[node as usize] = k as u32;
        }
        let mean = stiffness.trace() / (AXES * nodes.len().max(1)) as f64;
        let exponent = mean.log2().round();
        let scale = if exponent.is_finite() { (-exponent).exp2() } else { 1.0 };
        Self { stiffness, partition, nodes, place, scale }
    }

    /// Nodes with an unknown axis, ascending.
    pub fn nodes(&self) -> &[u32] {
        &self.nodes
    }

    /// What the stiffness was multiplied with.
    pub fn scale(&self) -> f64 {
        self.scale
    }

    /// Which axes of a row are unknown.
    pub fn unknown_axes(&self, row: usize) -> [bool; AXES] {
        let node = self.nodes[row] as usize;
        std::array::from_fn(|axis| self.partition.row_of(dof(node, axis)).is_some())
    }

    /// Where the node of a row is at rest, m.
    pub fn place_of(&self, row: usize) -> [f64; AXES] {
        self.stiffness.pattern().places()[self.nodes[row] as usize].coords.into()
    }
}

impl NodeMatrix<AXES, AXES> for FineRows<'_> {
    fn row_count(&self) -> usize {
        self.nodes.len()
    }

    fn visit(&self, row: usize, visit: &mut dyn FnMut(usize, &[[f64; AXES]; AXES])) {
        let node = self.nodes[row] as usize;
        let of_row = self.unknown_axes(row);
        for (other, block) in self.stiffness.row(node) {
            let column = self.place[other];
            if column == NONE {
                continue;
            }
            let of_column = self.unknown_axes(column as usize);
            let entry = |r: usize, c: usize| {
                let is_own = other == node && r == c;
                match (of_row[r] && of_column[c]) || is_own {
                    true => self.scale * block[AXES * r + c],
                    false => 0.0,
                }
            };
            visit(column as usize, &std::array::from_fn(|r| std::array::from_fn(|c| entry(r, c))));
        }
    }
}
