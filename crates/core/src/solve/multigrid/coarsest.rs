//! The coarsest level: a dense factor where it is small, smoothing where it is not.

use super::block_rows::{BlockRows, NodeMatrix};
use super::chebyshev::{Chebyshev, Vectors};
use super::motions::MOTIONS;
use crate::solve::tiles::Tiles;

/// Solver of the coarsest level.
pub(super) enum Coarsest {
    /// Dense Cholesky factor.
    Factor(Tiles),
    /// Where many bodies end in one aggregate each, or rounding leaves no factor, the level is
    /// smoothed.
    Smoothed(BlockRows<MOTIONS, MOTIONS>, Chebyshev<MOTIONS>),
}

/// A level with more nodes is not factored: its factor would take longer than all the rest.
const NODES_MAX: usize = 500;
/// Added to the diagonal where rounding makes the matrix lose its definiteness, one after another.
const SHIFTS: [f64; 4] = [0.0, 1e-7, 1e-6, 1e-5];

impl Coarsest {
    pub fn new(a: BlockRows<MOTIONS, MOTIONS>) -> Self {
        if a.row_count() <= NODES_MAX {
            for shift in SHIFTS {
                let mut tiles = dense(&a, shift);
                if tiles.factor().is_ok() {
                    return Self::Factor(tiles);
                }
            }
        }
        let smoother = Chebyshev::new(&a);
        Self::Smoothed(a, smoother)
    }

    /// Bytes held.
    pub fn bytes(&self) -> usize {
        match self {
            Self::Factor(tiles) => tiles.bytes(),
            Self::Smoothed(a, smoother) => a.bytes() + smoother.bytes(),
        }
    }

    /// The answer, or something near it, in `v.x` for the right-hand side `v.r`.
    pub fn solve(&self, v: &mut Vectors<MOTIONS>) {
        match self {
            Self::Factor(tiles) => {
                let mut b: Vec<f64> = v.r.iter().flatten().map(|x| f64::from(*x)).collect();
                tiles.solve_in_place(&mut b);
                for (x, b) in v.x.iter_mut().zip(b.as_chunks::<MOTIONS>().0) {
                    *x = b.map(|b| b as f32);
                }
            }
            Self::Smoothed(a, smoother) => {
                v.x.fill([0.0; MOTIONS]);
                smoother.smooth(a, v, true);
                smoother.smooth(a, v, false);
            }
        }
    }
}

/// The lower triangle as a dense matrix, its diagonal larger by a share.
fn dense(a: &BlockRows<MOTIONS, MOTIONS>, shift: f64) -> Tiles {
    let mut tiles = Tiles::zeros(MOTIONS * a.row_count());
    for row in 0..a.row_count() {
        a.visit(row, &mut |column, block| {
            for (r, line) in block.iter().enumerate() {
                for (c, value) in line.iter().enumerate() {
                    let (i, j) = (MOTIONS * row + r, MOTIONS * column + c);
                    let value = if i == j { value * (1.0 + shift) } else { *value };
                    if i >= j {
                        tiles.add(i, j, value);
                    }
                }
            }
        });
    }
    tiles
}
