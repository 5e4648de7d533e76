//! What a method makes of `K11`: an explicit inverse, a factor or a hierarchy, and products with it.

use crate::solve::Partition;
use crate::solve::columns::norms;
use crate::solve::front::FrontFactor;
use crate::solve::gauss_jordan;
use crate::solve::multigrid::Hierarchy;
use crate::solve::sparse::SparseFactor;
use crate::solve::tiles::Tiles;
use crate::solve::vectors::norm;

/// An inverse of `K11`, a factor of it, or what stands in for one.
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
    /// Factor over the tree of fronts in single precision.
    FrontSingle(FrontFactor<f32>),
    /// No inverse, but a hierarchy that conjugate gradients go by.
    Multigrid(Box<Hierarchy>),
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
            Self::Multigrid(hierarchy) => hierarchy.bytes(),
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
            Self::FrontSingle(factor) if n > 0 => {
                let scales: Vec<f64> = b.chunks(n).map(|b| safe_scale(norm(b))).collect();
                let scale = |b: &mut [f64], by: &dyn Fn(f64) -> f64| {
                    for (b, s) in b.chunks_mut(n).zip(&scales) {
                        b.iter_mut().for_each(|b| *b *= by(*s));
                    }
                };
                scale(&mut b, &|s| 1.0 / s);
                factor.solve_in_place(&mut b, columns);
                scale(&mut b, &|s| s);
                b
            }
            _ => b.chunks(n.max(1)).flat_map(|b| self.apply(b.to_vec())).collect(),
        }
    }

    /// Whether [`Kernel::apply_to_rows`] is there.
    pub fn takes_rows(&self) -> bool {
        matches!(self, Self::Front(_) | Self::FrontSingle(_))
    }

    /// `K11⁻¹ B` with the numbers of one row next to each other, into `x`, whose known rows become
    /// zero; `x` as it is for a kernel that is no factor over fronts.
    ///
    /// Shapes: `b` and `x` 3N × `columns` row-major; known rows of `b` are not read, but must be zero
    /// or small beside the others.
    pub fn apply_to_rows(&self, b: &[f64], x: &mut [f64], columns: usize, partition: &Partition) {
        match self {
            Self::Front(factor) => factor.solve_rows((b, x), &vec![1.0; columns], partition),
            Self::FrontSingle(factor) => {
                // Scaled as in `apply`.
                let scales: Vec<f64> = norms(b, columns).into_iter().map(safe_scale).collect();
                factor.solve_rows((b, x), &scales, partition);
            }
            _ => {}
        }
    }

    /// `K11⁻¹ b`; nearly so by one cycle through a hierarchy.
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
            Self::Multigrid(hierarchy) => hierarchy.apply_to_unknown(&b),
        }
    }
}

/// A scale that can be divided by.
fn safe_scale(norm: f64) -> f64 {
    if norm > 0.0 && norm.is_finite() { norm } else { 1.0 }
}
