//! Matrices of small dense blocks, by rows: sparse ones in single precision, and `K11` in blocks of three as
//! the finest level of a hierarchy sees it.

use pulp::{Arch, Simd, WithSimd};
use rayon::prelude::*;

use crate::fem::{AXES, Stiffness, dof};
use crate::solve::Partition;

/// Rows of one task of a parallel loop.
pub(super) const TASK_ROWS: usize = 128;

/// A matrix of one block for each pair of nodes, read by rows in double precision.
pub(super) trait NodeMatrix<const R: usize, const C: usize>: Sync {
    /// Number of block rows.
    fn row_count(&self) -> usize;

    /// Calls `visit(column, block)` for the blocks of one row, columns ascending.
    fn visit(&self, row: usize, visit: &mut dyn FnMut(usize, &[[f64; C]; R]));
}

/// A sparse matrix of R × C blocks.
///
/// Shapes: row i holds blocks `start[i] .. start[i + 1]`, their columns ascending.
pub(super) struct BlockRows<const R: usize, const C: usize> {
    start: Vec<usize>,
    columns: Vec<u32>,
    blocks: Vec<[[f32; C]; R]>,
}

impl<const R: usize, const C: usize> BlockRows<R, C> {
    /// Makes the rows in parallel: `columns_of(row, columns)` appends the columns of a row, in any
    /// order and repeatedly, then `fill(row, columns, blocks)` adds to its blocks, which are zero at
    /// first and rounded at the end.
    pub fn build(
        rows: usize,
        columns_of: impl Fn(usize, &mut Vec<u32>) + Sync,
        fill: impl Fn(usize, &[u32], &mut [[[f64; C]; R]]) + Sync,
    ) -> Self {
        let (start, columns) = pattern(rows, columns_of);
        let mut blocks = vec![[[0.0; C]; R]; columns.len()];
        split(&mut blocks, &start).into_par_iter().enumerate().for_each(|(task, mut blocks)| {
            let mut exact = Vec::new();
            for row in task * TASK_ROWS..rows.min((task + 1) * TASK_ROWS) {
                let (of_row, rest) = blocks.split_at_mut(start[row + 1] - start[row]);
                exact.clear();
                exact.resize(of_row.len(), [[0.0f64; C]; R]);
                fill(row, &columns[start[row]..start[row + 1]], &mut exact);
                for (rounded, exact) in of_row.iter_mut().zip(&exact) {
                    *rounded = exact.map(|line| line.map(|x| x as f32));
                }
                blocks = rest;
            }
        });
        Self { start, columns, blocks }
    }

    /// The rows of several matrices, one below the other; each is given back as soon as it is copied.
    pub fn stacked(parts: Vec<Self>) -> Self {
        let count: usize = parts.iter().map(Self::block_count).sum();
        let mut stacked = Self {
            start: vec![0],
            columns: Vec::with_capacity(count),
            blocks: Vec::with_capacity(count),
        };
        for part in parts {
            let before = stacked.blocks.len();
            stacked.start.extend(part.start[1..].iter().map(|start| before + start));
            stacked.columns.extend_from_slice(&part.columns);
            stacked.blocks.extend_from_slice(&part.blocks);
        }
        stacked
    }

    /// Number of stored blocks.
    pub fn block_count(&self) -> usize {
        self.blocks.len()
    }
    pub fn bytes(&self) -> usize {
        std::mem::size_of_val(self.start.as_slice())
            + std::mem::size_of_val(self.columns.as_slice())
            + std::mem::size_of_val(self.blocks.as_slice())
    }

    /// Columns of one row, ascending.
    pub fn columns(&self, row: usize) -> &[u32] {
        &self.columns[self.range(row)]
    }

    /// Blocks of one row.
    pub fn blocks(&self, row: usize) -> &[[[f32; C]; R]] {
        &self.blocks[self.range(row)]
    }

    /// One block by its place among all.
    pub fn block(&self, at: usize) -> &[[f32; C]; R] {
        &self.blocks[at]
    }

    /// Places of the blocks of one row.
    pub fn range(&self, row: usize) -> std::ops::Range<usize> {
        self.start[row]..self.start[row + 1]
    }

    /// Calls `each(k, product of row first + k with x)` for some rows, in their order.
    ///
    /// Shapes: `x` one place for each column, with W vectors next to each other.
    pub fn products<const W: usize>(
        &self,
        (first, count): (usize, usize),
        x: &[[[f32; W]; C]],
        each: impl FnMut(usize, [[f32; W]; R]),
    ) {
        Arch::new().dispatch(Products { matrix: self, first, count, x, each });
    }

    /// Product of one row. With one vector terms of one entry of the block are added up first, then those of
    /// a line; several vectors fill the registers by themselves.
    #[inline(always)]
    fn product<const W: usize>(&self, row: usize, x: &[[[f32; W]; C]]) -> [[f32; W]; R] {
        let range = self.range(row);
        let pairs = self.blocks[range.clone()].iter().zip(&self.columns[range]);
        if W == 1 {
            let mut sums = [[0.0f32; C]; R];
            for (block, &column) in pairs {
                let x = &x[column as usize];
                for (sums, block) in sums.iter_mut().zip(block) {
                    for c in 0..C {
                        sums[c] += block[c] * x[c][0];
                    }
                }
            }
            return sums.map(|line| [line.iter().sum(); W]);
        }
        let mut sums = [[0.0f32; W]; R];
        for (block, &column) in pairs {
            let x = &x[column as usize];
            for (sum, line) in sums.iter_mut().zip(block) {
                for (entry, x) in line.iter().zip(x) {
                    for w in 0..W {
                        sum[w] += entry * x[w];
                    }
                }
            }
        }
        sums
    }
}

impl<const B: usize> NodeMatrix<B, B> for BlockRows<B, B> {
    fn row_count(&self) -> usize {
        self.start.len() - 1
    }

    fn visit(&self, row: usize, visit: &mut dyn FnMut(usize, &[[f64; B]; B])) {
        for (&column, block) in self.columns(row).iter().zip(self.blocks(row)) {
            visit(column as usize, &block.map(|line| line.map(f64::from)));
        }
    }
}

/// Some rows of a product.
struct Products<'a, F, const R: usize, const C: usize, const W: usize> {
    matrix: &'a BlockRows<R, C>,
    first: usize,
    count: usize,
    x: &'a [[[f32; W]; C]],
    each: F,
}

impl<F: FnMut(usize, [[f32; W]; R]), const R: usize, const C: usize, const W: usize> WithSimd
    for Products<'_, F, R, C, W>
{
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let Self { matrix, first, count, x, mut each } = self;
        for k in 0..count {
            each(k, matrix.product(first + k, x));
        }
    }
}

/// Starts of rows and their columns, ascending and each once.
fn pattern(
    rows: usize,
    columns_of: impl Fn(usize, &mut Vec<u32>) + Sync,
) -> (Vec<usize>, Vec<u32>) {
    let tasks: Vec<(Vec<usize>, Vec<u32>)> = (0..rows.div_ceil(TASK_ROWS))
        .into_par_iter()
        .map(|task| {
            let (mut lens, mut columns, mut of_row) = (Vec::new(), Vec::new(), Vec::new());
            for row in task * TASK_ROWS..rows.min((task + 1) * TASK_ROWS) {
                of_row.clear();
                columns_of(row, &mut of_row);
                of_row.sort_unstable();
                of_row.dedup();
                lens.push(of_row.len());
                columns.extend_from_slice(&of_row);
            }
            (lens, columns)
        })
        .collect();
    let mut start = Vec::with_capacity(rows + 1);
    start.push(0);
    let mut columns = Vec::with_capacity(tasks.iter().map(|task| task.1.len()).sum());
    let mut end = 0;
    for (lens, of_task) in tasks {
        columns.extend_from_slice(&of_task);
        for len in lens {
            end += len;
            start.push(end);
        }
    }
    (start, columns)
}

/// The blocks of each task's rows.
fn split<'a, T>(blocks: &'a mut [T], start: &[usize]) -> Vec<&'a mut [T]> {
    let rows = start.len() - 1;
    let mut rest = blocks;
    let mut tasks = Vec::with_capacity(rows.div_ceil(TASK_ROWS));
    for first in (0..rows).step_by(TASK_ROWS) {
        let len = start[rows.min(first + TASK_ROWS)] - start[first];
        let (of_task, tail) = rest.split_at_mut(len);
        tasks.push(of_task);
        rest = tail;
    }
    tasks
}

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
