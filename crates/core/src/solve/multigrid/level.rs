//! One level: its matrix, how it is smoothed, and how it hangs together with the next coarser one.

use rayon::prelude::*;

use super::aggregates::Aggregates;
use super::block_rows::{BlockRows, NodeMatrix, TASK_ROWS};
use super::chebyshev::{Chebyshev, Vectors, subtract_product};
use super::galerkin::{self, ByColumn};
use super::motions::{MOTIONS, OfNode, orthonormal};

/// One level of a hierarchy, B unknowns at each node.
pub(super) struct Level<const B: usize> {
    a: BlockRows<B, B>,
    smoother: Chebyshev<B>,
    p: BlockRows<B, MOTIONS>,
    by_column: ByColumn,
}

/// The next coarser level: its matrix, and the rigid motions on it.
pub(super) struct Coarser {
    pub a: BlockRows<MOTIONS, MOTIONS>,
    pub motions: Vec<OfNode<MOTIONS>>,
}

/// Damping of the Jacobi step of the prolongator, over the largest eigenvalue.
///
/// Source: Vaněk, Mandel, Brezina 1996, section 3.
const OMEGA: f64 = 4.0 / 3.0;

/// The prolongator of a level, its blocks by columns, and the next coarser level.
type Coarsened<const B: usize> = (BlockRows<B, MOTIONS>, ByColumn, Coarser);

fn coarsen<const B: usize>(
    rows: &impl NodeMatrix<B, B>,
    smoother: &Chebyshev<B>,
    motions: Vec<OfNode<B>>,
    number: usize,
) -> Coarsened<B> {
    let aggregates = Aggregates::new(rows, number);
    let (tentative, coarse_motions) = orthonormal(&motions, &aggregates);
    drop(motions);
    let p = galerkin::smoothed(rows, &aggregates, &tentative, OMEGA / smoother.largest());
    drop(tentative);
    let by_column = ByColumn::new(&p, rows.row_count(), aggregates.count());
    let a = galerkin::product(rows, &p, &by_column, aggregates.count());
    (p, by_column, Coarser { a, motions: coarse_motions })
}

impl<const B: usize> Level<B> {
    /// The level of a matrix that is there in double precision, and what it hands to the next coarser
    /// one.
    ///
    /// Shapes: `motions` one per node.
    pub fn of_fine(rows: &impl NodeMatrix<B, B>, motions: Vec<OfNode<B>>) -> (Self, Coarser) {
        let columns_of = |row: usize, columns: &mut Vec<u32>| {
            rows.visit(row, &mut |column, _| columns.push(column as u32));
        };
        let fill = |row: usize, _: &[u32], blocks: &mut [[[f64; B]; B]]| {
            let mut blocks = blocks.iter_mut();
            rows.visit(row, &mut |_, block| {
                if let Some(place) = blocks.next() {
                    *place = *block;
                }
            });
        };
        let a = BlockRows::build(rows.row_count(), columns_of, fill);
        let smoother = Chebyshev::new(&a);
        let (p, by_column, coarser) = coarsen(rows, &smoother, motions, 0);
        (Self { a, smoother, p, by_column }, coarser)
    }

    /// Level of a matrix in single precision; `number` counts from 0, the finest.
    pub fn of_coarse(
        a: BlockRows<B, B>,
        motions: Vec<OfNode<B>>,
        number: usize,
    ) -> (Self, Coarser) {
        let smoother = Chebyshev::new(&a);
        let (p, by_column, coarser) = coarsen(&a, &smoother, motions, number);
        (Self { a, smoother, p, by_column }, coarser)
    }

    /// Number of nodes.
    pub fn row_count(&self) -> usize {
        self.a.row_count()
    }

    /// How nodes of this level follow the motions of aggregates.
    #[cfg(test)]
    pub fn prolongator(&self) -> &BlockRows<B, MOTIONS> {
        &self.p
    }
    pub fn bytes(&self) -> usize {
        self.a.bytes() + self.smoother.bytes() + self.p.bytes() + self.by_column.bytes()
    }

    /// Smooths from nothing, and hands what is left to the coarser level: `Pᵀ r`.
    ///
    /// Shapes: `v` this level's, `v.r` the right-hand sides; `coarse` one place per aggregate.
    pub fn descend<const W: usize>(
        &self,
        v: &mut Vectors<B, W>,
        coarse: &mut [[[f32; W]; MOTIONS]],
    ) {
        v.x.par_chunks_mut(TASK_ROWS).for_each(|x| x.fill([[0.0; W]; B]));
        self.smoother.smooth(&self.a, v, true);
        let r = &v.r;
        coarse.par_iter_mut().with_min_len(TASK_ROWS / 4).enumerate().for_each(|(column, sum)| {
            *sum = [[0.0; W]; MOTIONS];
            for &(row, at) in self.by_column.of(column) {
                for (line, r) in self.p.block(at as usize).iter().zip(&r[row as usize]) {
                    for (sum, entry) in sum.iter_mut().zip(line) {
                        (0..W).for_each(|w| sum[w] += entry * r[w]);
                    }
                }
            }
        });
    }

    /// Takes the coarser level's correction, `x + P e`, and smooths what it leaves.
    pub fn ascend<const W: usize>(&self, v: &mut Vectors<B, W>, coarse: &[[[f32; W]; MOTIONS]]) {
        v.take_correction(|first, step| {
            self.p.products((first, step.len()), coarse, |row, product| step[row] = product);
        });
        let (step, r) = v.step_and_residual();
        subtract_product(&self.a, step, r);
        self.smoother.smooth(&self.a, v, false);
    }
}
