//! The next coarser level: the prolongator, how the nodes of a level follow the motions of aggregates; and
//! its matrix, `Pᵀ A P`.

use std::ops::Range;

use super::aggregates::Aggregates;
use super::block_rows::{BlockRows, NodeMatrix};
use super::motions::{MOTIONS, OfNode};
use super::small::{add_product, add_transposed_product, exact, inverse};

/// `P = (I − ω D⁻¹ A) P̂`: nodes follow their aggregate rigidly (`P̂`), and one damped Jacobi step takes
/// out the forces that this makes where aggregates meet.
///
/// Shapes: `tentative` one per node, orthonormal in each aggregate; `omega` of `D⁻¹ A`.
///
/// Source: Vaněk, Mandel, Brezina 1996, section 3.
pub(super) fn smoothed<const B: usize>(
    rows: &impl NodeMatrix<B, B>,
    aggregates: &Aggregates,
    tentative: &[OfNode<B>],
    omega: f64,
) -> BlockRows<B, MOTIONS> {
    let columns_of = |row: usize, columns: &mut Vec<u32>| {
        rows.visit(row, &mut |node, _| columns.push(aggregates.of(node)));
        columns.retain(|&aggregate| aggregate != Aggregates::NONE);
    };
    let fill = |row: usize, columns: &[u32], blocks: &mut [OfNode<B>]| {
        let mut own = [[0.0; B]; B];
        rows.visit(row, &mut |node, block| {
            let aggregate = aggregates.of(node);
            if node == row {
                own = *block;
            }
            if aggregate != Aggregates::NONE {
                let at = columns.partition_point(|&c| c < aggregate);
                add_product(&mut blocks[at], block, &tentative[node]);
            }
        });
        let step = inverse(&own).map(|line| line.map(|x| -omega * x));
        for (&aggregate, block) in columns.iter().zip(blocks) {
            let force = std::mem::replace(block, [[0.0; MOTIONS]; B]);
            if aggregate == aggregates.of(row) {
                *block = tentative[row];
            }
            add_product(block, &step, &force);
        }
    };
    BlockRows::build(rows.row_count(), columns_of, fill)
}

/// Where the blocks of each column of a matrix stand.
pub(super) struct ByColumn {
    start: Vec<usize>,
    /// Row and place of each block.
    blocks: Vec<(u32, u32)>,
}

impl ByColumn {
    /// Blocks by columns, rows ascending (counting sort).
    ///
    /// # Panics
    /// If there are 2³² blocks.
    pub fn new<const R: usize, const C: usize>(
        matrix: &BlockRows<R, C>,
        rows: usize,
        columns: usize,
    ) -> Self {
        assert!(matrix.block_count() < u32::MAX as usize, "places of blocks fit 32 bits");
        let mut start = vec![0usize; columns + 1];
        for row in 0..rows {
            matrix.columns(row).iter().for_each(|&column| start[column as usize + 1] += 1);
        }
        for column in 0..columns {
            start[column + 1] += start[column];
        }
        let mut next = start.clone();
        let mut blocks = vec![(0, 0); matrix.block_count()];
        for row in 0..rows {
            for (&column, at) in matrix.columns(row).iter().zip(matrix.range(row)) {
                blocks[next[column as usize]] = (row as u32, at as u32);
                next[column as usize] += 1;
            }
        }
        Self { start, blocks }
    }

    /// Rows and places of the blocks of a column.
    pub fn of(&self, column: usize) -> &[(u32, u32)] {
        &self.blocks[self.start[column]..self.start[column + 1]]
    }
    pub fn bytes(&self) -> usize {
        std::mem::size_of_val(self.start.as_slice()) + std::mem::size_of_val(self.blocks.as_slice())
    }
}

/// Aggregates whose rows are made at once: what they are made of is held for so many only.
const TOGETHER: usize = 4096;

/// `Pᵀ A P` by rows, summed in double precision. Motions that an aggregate does not have get a one on
/// the diagonal, so that the matrix stays positive definite.
///
/// Shapes: `p` and `by_column` nodes × aggregates; result aggregates × aggregates.
pub(super) fn product<const B: usize>(
    rows: &impl NodeMatrix<B, B>,
    p: &BlockRows<B, MOTIONS>,
    by_column: &ByColumn,
    aggregates: usize,
) -> BlockRows<MOTIONS, MOTIONS> {
    let parts = (0..aggregates.div_ceil(TOGETHER)).map(|part| {
        let first = part * TOGETHER;
        some_rows(rows, p, by_column, first..aggregates.min(first + TOGETHER))
    });
    BlockRows::stacked(parts.collect())
}

/// The rows of some aggregates.
fn some_rows<const B: usize>(
    rows: &impl NodeMatrix<B, B>,
    p: &BlockRows<B, MOTIONS>,
    by_column: &ByColumn,
    aggregates: Range<usize>,
) -> BlockRows<MOTIONS, MOTIONS> {
    let mut nodes: Vec<u32> =
        aggregates.clone().flat_map(|a| by_column.of(a)).map(|&(row, _)| row).collect();
    nodes.sort_unstable();
    nodes.dedup();
    let ap = times_prolongator(rows, p, &nodes);
    let place = |row: u32| nodes.partition_point(|&node| node < row);
    let columns_of = |k: usize, columns: &mut Vec<u32>| {
        for &(row, _) in by_column.of(aggregates.start + k) {
            columns.extend_from_slice(ap.columns(place(row)));
        }
    };
    let fill = |k: usize, columns: &[u32], blocks: &mut [[[f64; MOTIONS]; MOTIONS]]| {
        let aggregate = aggregates.start + k;
        for &(row, at) in by_column.of(aggregate) {
            let of_p = exact(p.block(at as usize));
            let row = place(row);
            for (column, force) in ap.columns(row).iter().zip(ap.blocks(row)) {
                let at = columns.partition_point(|c| c < column);
                add_transposed_product(&mut blocks[at], &of_p, &exact(force));
            }
        }
        let own = columns.partition_point(|&c| (c as usize) < aggregate);
        if let Some(block) = blocks.get_mut(own) {
            fill_missing(block);
        }
    };
    BlockRows::build(aggregates.len(), columns_of, fill)
}

/// The rows of some nodes of `A P`.
fn times_prolongator<const B: usize>(
    rows: &impl NodeMatrix<B, B>,
    p: &BlockRows<B, MOTIONS>,
    nodes: &[u32],
) -> BlockRows<B, MOTIONS> {
    let columns_of = |k: usize, columns: &mut Vec<u32>| {
        rows.visit(nodes[k] as usize, &mut |node, _| columns.extend_from_slice(p.columns(node)));
    };
    let fill = |k: usize, columns: &[u32], blocks: &mut [[[f64; MOTIONS]; B]]| {
        rows.visit(nodes[k] as usize, &mut |node, block| {
            for (column, of_p) in p.columns(node).iter().zip(p.blocks(node)) {
                let at = columns.partition_point(|c| c < column);
                add_product(&mut blocks[at], block, &exact(of_p));
            }
        });
    };
    BlockRows::build(nodes.len(), columns_of, fill)
}

/// A one, in the unit of the block, for motions without stiffness.
fn fill_missing(block: &mut [[f64; MOTIONS]; MOTIONS]) {
    let largest = (0..MOTIONS).map(|k| block[k][k]).fold(0.0, f64::max);
    let one = if largest > 0.0 { largest } else { 1.0 };
    for k in 0..MOTIONS {
        if block[k][k] <= 0.0 {
            block[k][k] = one;
        }
    }
}
