//! `K11` ordered and analysed, and what a method makes of it: an explicit inverse, a factor or a
//! hierarchy, and products with it.

use std::sync::Arc;

use super::error::SolveError;
use crate::fem::Stiffness;
use crate::solve::front::{FrontAnalysis, FrontError, FrontFactor};
use crate::solve::k11::{NotPositive, SparseK11, visit_k11};
use crate::solve::memory::hierarchy_bytes;
use crate::solve::multigrid::Hierarchy;
use crate::solve::oracle::gauss_jordan;
use crate::solve::oracle::sparse::{Analysis, SparseFactor};
use crate::solve::tiles::Tiles;
use crate::solve::vectors::norm;
use crate::solve::vectors::norms;
use crate::solve::{Method, Partition, Stage, Within, ordering};

/// `K11` of one partition, ordered and analysed but not factored yet: what a factor will cost is
/// known, so a precision can be chosen by it.
///
/// Source: thesis (3.41).
#[derive(Clone)]
pub struct Analysed {
    partition: Partition,
    analysis: Arc<FrontAnalysis>,
}

impl Analysed {
    /// Orders and analyses `K11`; `on_stage` hears [`Stage::Order`].
    pub fn new(
        stiffness: &Stiffness,
        partition: Partition,
        on_stage: &mut dyn FnMut(Stage),
    ) -> Self {
        on_stage(Stage::Order);
        let analysis = Arc::new(FrontAnalysis::new(stiffness, &partition));
        Self { partition, analysis }
    }

    /// Operations, entries and memory of a factor.
    pub fn analysis(&self) -> &Arc<FrontAnalysis> {
        &self.analysis
    }

    /// Bytes held at most while the factor of a method over fronts is made, the factor included.
    pub fn peak_bytes(&self, method: Method) -> u64 {
        self.analysis.peak_bytes_of(method) as u64
    }

    /// The partition that was analysed.
    pub(super) fn into_partition(self) -> Partition {
        self.partition
    }

    /// The factor on the current rayon pool; `on_stage` hears [`Stage::Factor`].
    ///
    /// `stiffness` must be the one this was analysed from.
    ///
    /// # Errors
    /// [`SolveError::NotPositiveDefinite`] with the node, [`SolveError::OutOfMemory`],
    /// [`SolveError::NoSuchFactor`] for a method without fronts.
    pub(super) fn kernel(
        &self,
        stiffness: &Stiffness,
        method: Method,
        on_stage: &mut dyn FnMut(Stage),
    ) -> Result<Kernel, SolveError> {
        let Self { partition, analysis } = self;
        if !method.has_fronts() {
            return Err(SolveError::NoSuchFactor { method });
        }
        on_stage(Stage::Factor);
        let unknown_dofs = partition.unknown().len();
        let failed = |error| match error {
            FrontError::NotPositive { row } => SolveError::not_positive(method, partition, row),
            _ => SolveError::OutOfMemory { method, unknown_dofs },
        };
        Ok(match method.is_single() {
            false => Kernel::Front(FrontFactor::try_new(analysis, stiffness).map_err(failed)?),
            true => Kernel::FrontSingle(FrontFactor::try_new(analysis, stiffness).map_err(failed)?),
        })
    }
}

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
    /// What a method without fronts makes of `K11`, on the current rayon pool.
    ///
    /// # Errors
    /// [`SolveError::NotPositiveDefinite`] with the node, [`SolveError::OutOfMemory`],
    /// [`SolveError::OverLimit`], [`SolveError::NoSuchFactor`] for the others.
    pub fn without_fronts(
        stiffness: &Stiffness,
        partition: &Partition,
        how: Within,
        on_stage: &mut dyn FnMut(Stage),
    ) -> Result<Self, SolveError> {
        let (n, method) = (partition.unknown().len(), how.method);
        let check = |needed: u64| SolveError::check_limit(how, needed, n);
        check(method.dense_bytes(n).unwrap_or(0))?;
        let not_positive =
            |error: NotPositive| SolveError::not_positive(method, partition, error.row);
        let out_of_memory = || SolveError::OutOfMemory { method, unknown_dofs: n };
        match method {
            Method::GaussJordan | Method::GaussJordanPlain => {
                on_stage(Stage::Factor);
                let entries = n.checked_mul(n).ok_or_else(out_of_memory)?;
                let mut inverse = Vec::new();
                inverse.try_reserve_exact(entries).map_err(|_| out_of_memory())?;
                inverse.resize(entries, 0.0);
                visit_k11(stiffness, partition, |i, j, value| inverse[i * n + j] = value);
                let inverted = match method {
                    Method::GaussJordanPlain => gauss_jordan::invert_plainly(&mut inverse, n),
                    _ => gauss_jordan::invert(&mut inverse, n),
                };
                inverted.map_err(not_positive)?;
                Ok(Self::Inverse(inverse))
            }
            Method::DenseInverse | Method::DenseCholesky => {
                on_stage(Stage::Factor);
                let mut tiles = Tiles::zeros(n);
                visit_k11(stiffness, partition, |i, j, value| tiles.add(i, j, value));
                if method == Method::DenseInverse {
                    tiles.invert().map_err(not_positive)?;
                    return Ok(Self::TiledInverse(tiles));
                }
                tiles.factor().map_err(not_positive)?;
                Ok(Self::TiledFactor(tiles))
            }
            Method::SparseCholesky => {
                on_stage(Stage::Order);
                let order = ordering::nested_dissection(stiffness, partition);
                let k11 = SparseK11::new(stiffness, partition);
                let analysis = Analysis::new(k11, order).map_err(|_| out_of_memory())?;
                check(analysis.bytes())?;
                on_stage(Stage::Factor);
                Ok(Self::Sparse(Box::new(analysis.factor().map_err(not_positive)?)))
            }
            Method::Multigrid => {
                let blocks = stiffness.pattern().block_count();
                check(hierarchy_bytes(stiffness.node_count(), blocks) as u64)?;
                on_stage(Stage::Factor);
                Ok(Self::Multigrid(Box::new(Hierarchy::new(stiffness, partition))))
            }
            Method::Front | Method::FrontMixed | Method::Pcg | Method::Condensed => {
                Err(SolveError::NoSuchFactor { method })
            }
        }
    }

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
