//! The prolongator: how the nodes of a level follow the motions of aggregates.

use super::aggregates::Aggregates;
use super::block_rows::{BlockRows, NodeMatrix};
use super::motions::{MOTIONS, OfNode};
use super::small::{add_product, inverse};

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
