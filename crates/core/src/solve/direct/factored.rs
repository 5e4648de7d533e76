//! `K11` of one partition, inverted or factored by one method.

use super::analysed::{Analysed, FrontMethod};
use super::error::SolveError;
use super::kernel::Kernel;
use super::refinement;
use crate::fem::Stiffness;
use crate::solve::certainty::{Certainty, inverse_norm, row_sums};
use crate::solve::k11::{SparseK11, visit_k11};
use crate::solve::pivot::NotPositive;
use crate::solve::sparse::Analysis;
use crate::solve::tiles::Tiles;
use crate::solve::worked_out::WorkedOut;
use crate::solve::{Method, Partition, Stage, gauss_jordan, gauss_jordan_plain, ordering};

/// `K11` of one partition, inverted or factored by one method.
///
/// Source: thesis (3.43a).
pub struct Factored {
    method: Method,
    partition: Partition,
    pub(super) kernel: Kernel,
    /// Skeel's condition number, once somebody has asked for it.
    condition: WorkedOut<f64>,
}

impl Factored {
    /// Inverts or factors `K11` of a partition on the current rayon pool.
    ///
    /// `on_stage` hears [`Stage::Order`] and [`Stage::Factor`] as they begin.
    ///
    /// # Errors
    /// [`SolveError::NotPositiveDefinite`] with the node, [`SolveError::OutOfMemory`].
    ///
    /// Source: thesis (3.43a), Appendix A for the Gauss–Jordan methods.
    pub fn try_new(
        stiffness: &Stiffness,
        partition: Partition,
        method: Method,
        on_stage: &mut dyn FnMut(Stage),
    ) -> Result<Self, SolveError> {
        Self::try_within(stiffness, partition, method, u64::MAX, on_stage)
    }

    /// The same where the factor or inverse may take so much memory only, which is looked at before
    /// it is allocated.
    ///
    /// Units: `limit` bytes.
    ///
    /// # Errors
    /// Those of [`Factored::try_new`], and [`SolveError::OverLimit`] with both numbers.
    pub fn try_within(
        stiffness: &Stiffness,
        partition: Partition,
        method: Method,
        limit: u64,
        on_stage: &mut dyn FnMut(Stage),
    ) -> Result<Self, SolveError> {
        let n = partition.unknown().len();
        let check = |needed: u64| match needed > limit {
            true => Err(SolveError::OverLimit { method, unknown_dofs: n, needed, limit }),
            false => Ok(()),
        };
        check(method.dense_bytes(n).unwrap_or(0))?;
        let not_positive =
            |error: NotPositive| SolveError::not_positive(method, &partition, error.row);
        let out_of_memory = || SolveError::OutOfMemory { method, unknown_dofs: n };
        let kernel = match method {
            Method::GaussJordan | Method::GaussJordanPlain => {
                on_stage(Stage::Factor);
                let entries = n.checked_mul(n).ok_or_else(out_of_memory)?;
                let mut inverse = Vec::new();
                inverse.try_reserve_exact(entries).map_err(|_| out_of_memory())?;
                inverse.resize(entries, 0.0);
                visit_k11(stiffness, &partition, |i, j, value| inverse[i * n + j] = value);
                match method {
                    Method::GaussJordanPlain => gauss_jordan_plain::invert(&mut inverse, n),
                    _ => gauss_jordan::invert(&mut inverse, n),
                }
                .map_err(not_positive)?;
                Kernel::Inverse(inverse)
            }
            Method::DenseInverse | Method::DenseCholesky => {
                on_stage(Stage::Factor);
                let mut tiles = Tiles::zeros(n);
                visit_k11(stiffness, &partition, |i, j, value| tiles.add(i, j, value));
                match method {
                    Method::DenseInverse => {
                        tiles.invert().map_err(not_positive)?;
                        Kernel::TiledInverse(tiles)
                    }
                    _ => {
                        tiles.factor().map_err(not_positive)?;
                        Kernel::TiledFactor(tiles)
                    }
                }
            }
            Method::SparseCholesky => {
                on_stage(Stage::Order);
                let order = ordering::nested_dissection(stiffness, &partition);
                let k11 = SparseK11::new(stiffness, &partition);
                let analysis = Analysis::new(k11, order).map_err(|_| out_of_memory())?;
                check(analysis.bytes())?;
                on_stage(Stage::Factor);
                Kernel::Sparse(Box::new(analysis.factor().map_err(not_positive)?))
            }
            Method::Front | Method::FrontMixed | Method::Pcg => {
                let front = FrontMethod::of(method).unwrap_or(FrontMethod::Double);
                let analysed = Analysed::new(stiffness, partition, on_stage);
                check(analysed.peak_bytes(front))?;
                return analysed.factor(stiffness, front, on_stage);
            }
        };
        Ok(Self { method, partition, kernel, condition: WorkedOut::default() })
    }

    /// The method used.
    pub fn method(&self) -> Method {
        self.method
    }

    /// The partition answered for.
    pub fn partition(&self) -> &Partition {
        &self.partition
    }

    /// Bytes held by the factor or inverse.
    pub fn bytes(&self) -> usize {
        self.kernel.bytes(self.partition.unknown().len())
    }

    /// `K11 x`, through the whole stiffness with zeros at the known degrees of freedom.
    pub(super) fn apply_k11(&self, stiffness: &Stiffness, x: &[f64]) -> Vec<f64> {
        let unknown = self.partition.unknown();
        let mut q = vec![0.0; self.partition.dof_count()];
        self.partition.scatter_unknown(x, &mut q);
        let f = stiffness.mul(&q);
        unknown.iter().map(|&dof| f[dof as usize]).collect()
    }

    /// How certain an answer of this factor is; the condition is estimated at the first call, by a
    /// few solves, and kept.
    ///
    /// `stiffness` must be the one this was factored from; `backward_error` that of the answer
    /// ([`crate::solve::Solution`]).
    pub fn certainty(&self, stiffness: &Stiffness, backward_error: f64) -> Certainty {
        let condition = self.condition.get_or(|| {
            let apply = |x: &[f64]| self.apply_k11(stiffness, x);
            let weights = row_sums(stiffness, self.partition());
            inverse_norm(&weights, &|b, columns| {
                refinement::apply_inverse_for_certain(
                    &self.kernel,
                    &apply,
                    b,
                    weights.len(),
                    columns,
                )
            })
        });
        Certainty::new(condition, backward_error)
    }

    /// `K11⁻¹ b`.
    pub(super) fn apply_inverse(&self, b: Vec<f64>) -> Vec<f64> {
        self.kernel.apply(b)
    }
}

impl Analysed {
    /// Factors on the current rayon pool; `on_stage` hears [`Stage::Factor`].
    ///
    /// `stiffness` must be the one this was analysed from.
    ///
    /// # Errors
    /// [`SolveError::NotPositiveDefinite`] with the node, [`SolveError::OutOfMemory`].
    pub fn factor(
        self,
        stiffness: &Stiffness,
        front: FrontMethod,
        on_stage: &mut dyn FnMut(Stage),
    ) -> Result<Factored, SolveError> {
        let method = Method::from(front);
        let (partition, kernel) = self.into_kernel(stiffness, front, on_stage)?;
        Ok(Factored { method, partition, kernel, condition: WorkedOut::default() })
    }
}
