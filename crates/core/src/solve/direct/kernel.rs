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

    /// `K11⁻¹ B` in place with the numbers of one row next to each other; B as it is for a kernel
    /// that is no factor over fronts.
    ///
    /// Shapes: `b` n × `columns` row-major.
    pub fn apply_to_rows(&self, b: &mut [f64], columns: usize) {
        match self {
            Self::Front(factor) => factor.solve_rows_in_place(b, columns),
            Self::FrontSingle(factor) => {
                // Scaled as in `apply`.
                let scales: Vec<f64> = norms(b, columns).iter().map(|s| safe_scale(*s)).collect();
                let scale = |b: &mut [f64], by: &dyn Fn(f64) -> f64| {
                    for row in b.chunks_exact_mut(columns) {
                        row.iter_mut().zip(&scales).for_each(|(b, s)| *b *= by(*s));
                    }
                };
                scale(b, &|s| 1.0 / s);
                factor.solve_rows_in_place(b, columns);
                scale(b, &|s| s);
            }
            _ => {}
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

/// A scale that can be divided by.
fn safe_scale(norm: f64) -> f64 {
    if norm > 0.0 && norm.is_finite() { norm } else { 1.0 }
}

/// Euclidean norms of the columns of numbers that stand row by row.
pub(super) fn norms(rows: &[f64], columns: usize) -> Vec<f64> {
    (0..columns)
        .map(|j| norm(&rows.iter().skip(j).step_by(columns).copied().collect::<Vec<f64>>()))
        .collect()
}
