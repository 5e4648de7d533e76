//! Rows of the columns of a contact set at the nodes that answers are wanted for.

use std::collections::BTreeSet;

use rayon::prelude::*;

use super::small_system::ContactAnswer;
use crate::solve::vectors::norm;

/// Rows of `[G R]` at the nodes asked for, gathered once per set of nodes.
///
/// Shapes: blocks of [`ROWS_TOGETHER`] rows (the last may be shorter), one behind the other, the
/// columns of a block one behind the other: the product runs once through this memory.
pub(super) struct WantedRows {
    pub nodes: Vec<u32>,
    blocks: Vec<f64>,
    /// Places in `nodes` of those that stand further ahead already, ascending.
    repeated: Vec<usize>,
}

/// Rows multiplied together: as many as stay in the nearest cache, a multiple of three.
const ROWS_TOGETHER: usize = 1536;
/// A product of more numbers is shared out among the threads; a smaller one is sooner done.
const SHARED_PRODUCT: usize = 1 << 20;

impl WantedRows {
    /// Gathers the rows of fields of 3N.
    pub fn new(nodes: &[u32], fields: &[&Vec<f64>]) -> Self {
        let mut blocks = vec![0.0; 3 * nodes.len() * fields.len()];
        let of_nodes = nodes.par_chunks(ROWS_TOGETHER / 3);
        let in_blocks = blocks.par_chunks_mut((ROWS_TOGETHER * fields.len()).max(1));
        of_nodes.zip(in_blocks).for_each(|(nodes, block)| {
            for (field, column) in fields.iter().zip(block.chunks_exact_mut(3 * nodes.len())) {
                for (row, &node) in column.as_chunks_mut::<3>().0.iter_mut().zip(nodes) {
                    row.copy_from_slice(&field[3 * node as usize..][..3]);
                }
            }
        });
        let mut seen = BTreeSet::new();
        let repeated = (0..nodes.len()).filter(|&at| !seen.insert(nodes[at])).collect();
        Self { nodes: nodes.to_vec(), blocks, repeated }
    }

    /// Numbers of all rows.
    pub fn len(&self) -> usize {
        self.blocks.len()
    }

    /// Displacements of an answer, 3 per node, m.
    pub fn displacements(&self, answer: &ContactAnswer) -> Vec<[f64; 3]> {
        let x: Vec<f64> = answer.lambda.iter().chain(&answer.amounts).copied().collect();
        let mut u = vec![[0.0; 3]; self.nodes.len()];
        let parts = u.chunks_mut(ROWS_TOGETHER / 3).map(|part| part.as_flattened_mut());
        let blocks = self.blocks.chunks((ROWS_TOGETHER * x.len()).max(1));
        match self.blocks.len() < SHARED_PRODUCT {
            true => parts.zip(blocks).for_each(|(u, block)| multiply(block, &x, u)),
            false => parts.zip(blocks).par_bridge().for_each(|(u, block)| multiply(block, &x, u)),
        }
        u
    }

    /// Norm of delivered displacements, every node once; zero where it is not known whose they are.
    pub fn size_of(&self, delivered: &[[f64; 3]]) -> f64 {
        if delivered.len() != self.nodes.len() {
            return 0.0;
        }
        if self.repeated.is_empty() {
            return norm(delivered.as_flattened());
        }
        let mut once = delivered.to_vec();
        self.repeated.iter().for_each(|&at| once[at] = [0.0; 3]);
        norm(once.as_flattened())
    }
}

/// `u += M x` for a block of columns, four at a time; the order of the sums is always the same.
fn multiply(block: &[f64], x: &[f64], u: &mut [f64]) {
    let rows = u.len().max(1);
    let mut fours = block.chunks_exact(4 * rows);
    let mut amounts = x.chunks_exact(4);
    for (four, x) in fours.by_ref().zip(amounts.by_ref()) {
        let (ab, cd) = four.split_at(2 * rows);
        let ((a, b), (c, d)) = (ab.split_at(rows), cd.split_at(rows));
        for ((((u, a), b), c), d) in u.iter_mut().zip(a).zip(b).zip(c).zip(d) {
            *u += (a * x[0] + b * x[1]) + (c * x[2] + d * x[3]);
        }
    }
    for (column, x) in fours.remainder().chunks_exact(rows).zip(amounts.remainder()) {
        u.iter_mut().zip(column).for_each(|(u, g)| *u += g * x);
    }
}
