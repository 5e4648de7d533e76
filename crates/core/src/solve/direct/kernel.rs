//! What a direct method makes of `K11`: an explicit inverse or a factor, and products with it.

use crate::solve::front::FrontFactor;
use crate::solve::gauss_jordan;
use crate::solve::sparse::SparseFactor;
use crate::solve::tiles::Tiles;
use crate::solve::vectors::norm;

/// An inverse of `K11`, or a factor of it.
pub(super) enum Kernel {
    /// Explicit inverse, row-major n × n.
    Inverse(Vec<f64>),
    /// Explicit inverse in tiles.
    TiledInverse(Tiles),
    /// Dense Cholesky factor in tiles.
    TiledFactor(Tiles),
    /// Sparse Cholesky factor.
    Sparse(Box<SparseFactor>),
    /// Factor over the tree of fronts.
    Front(FrontFactor<f64>),
    /// The same in single precision.
    FrontSingle(FrontFactor<f32>),
}

impl Kernel {
    /// Bytes held, `n` being the number of unknowns.
    pub fn bytes(&self, n: usize) -> usize {
        match self {
            Self::Inverse(values) => std::mem::size_of_val(values.as_slice()),
            Self::TiledInverse(_) | Self::TiledFactor(_) => 4 * n * n,
            Self::Sparse(factor) => factor.bytes(),
            Self::Front(factor) => factor.bytes(),
            Self::FrontSingle(factor) => factor.bytes(),
        }
    }

    /// Whether it is in single precision, so that every product with it needs refinement.
    pub fn is_single(&self) -> bool {
        matches!(self, Self::FrontSingle(_))
    }

    /// `K11⁻¹ B` for columns of n, one behind the other.
    pub fn apply_to_columns(&self, mut b: Vec<f64>, n: usize, columns: usize) -> Vec<f64> {
        match self {
            Self::Front(factor) => {
                factor.solve_in_place(&mut b, columns);
                b
            }
            _ => b.chunks(n.max(1)).flat_map(|b| self.apply(b.to_vec())).collect(),
        }
    }

    /// `K11⁻¹ b`.
    pub fn apply(&self, mut b: Vec<f64>) -> Vec<f64> {
        match self {
            Self::Inverse(inverse) => gauss_jordan::mul(inverse, &b),
            Self::TiledInverse(inverse) => inverse.mul(&b),
            Self::TiledFactor(factor) => {
                factor.solve_in_place(&mut b);
                b
            }
            Self::Sparse(factor) => {
                factor.solve_in_place(&mut b);
                b
            }
            Self::Front(factor) => {
                factor.solve_in_place(&mut b, 1);
                b
            }
            Self::FrontSingle(factor) => {
                // Scaled to one, so that small units do not fall below single precision's range.
                let scale = norm(&b);
                if scale > 0.0 && scale.is_finite() {
                    b.iter_mut().for_each(|x| *x /= scale);
                    factor.solve_in_place(&mut b, 1);
                    b.iter_mut().for_each(|x| *x *= scale);
                }
                b
            }
        }
    }
}
