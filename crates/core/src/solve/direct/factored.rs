//! `K11` of one partition, inverted or factored by one method.

use std::sync::Arc;

use super::analysed::Analysed;
use super::error::SolveError;
use super::fallback::Fallback;
use super::kernel::Kernel;
use super::refinement;
use crate::fem::Stiffness;
use crate::solve::certainty::{Certainty, inverse_norm, row_sums};
use crate::solve::front::FrontFactor;
use crate::solve::k11::{SparseK11, visit_k11};
use crate::solve::memory::hierarchy_bytes;
use crate::solve::multigrid::Hierarchy;
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
    kernel: Kernel,
    /// Bytes that this may take, with a factor in double precision beside the single one.
    limit: u64,
    /// Why double precision was taken already when this was made.
    began_with: Option<Fallback>,
    /// The factor in double precision, once refinement has come to a halt; none if it failed too.
    double: WorkedOut<Option<Arc<Kernel>>>,
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

    /// Factor or inverse of `K11` that may take so much memory only, which is looked at before it is
    /// allocated.
    ///
    /// Units: `limit` bytes.
    ///
    /// # Errors
    /// Those of [`Factored::try_new`], and [`SolveError::OverLimit`] with both numbers.
    ///
    /// Where a factor in single precision fails double precision is taken, as by
    /// [`Analysed::factor_within`].
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
        if method == Method::Condensed {
            return Err(SolveError::NoSuchFactor { method });
        }
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
            Method::Multigrid => {
                let blocks = stiffness.pattern().block_count();
                check(hierarchy_bytes(stiffness.node_count(), blocks) as u64)?;
                on_stage(Stage::Factor);
                Kernel::Multigrid(Box::new(Hierarchy::new(stiffness, &partition)))
            }
            Method::Front | Method::FrontMixed | Method::Pcg | Method::Condensed => {
                let analysed = Analysed::new(stiffness, partition, on_stage);
                return analysed.factor_within(stiffness, method, limit, on_stage);
            }
        };
        Ok(Self::of(method, partition, kernel, limit))
    }

    fn of(method: Method, partition: Partition, kernel: Kernel, limit: u64) -> Self {
        let (double, condition) = (WorkedOut::default(), WorkedOut::default());
        Self { method, partition, kernel, limit, began_with: None, double, condition }
    }

    /// The method used.
    pub fn method(&self) -> Method {
        self.method
    }

    /// The partition answered for.
    pub fn partition(&self) -> &Partition {
        &self.partition
    }

    /// Bytes held by the factor or inverse: more once double precision had to be taken beside a
    /// factor in single precision.
    pub fn bytes(&self) -> usize {
        let n = self.partition.unknown().len();
        let double = self.double.get().flatten();
        self.kernel.bytes(n) + double.map_or(0, |kernel| kernel.bytes(n))
    }

    /// Why answers are of double precision where the method asked for single, if they are.
    pub fn fallback(&self) -> Option<Fallback> {
        let stalled = || self.double.get().flatten().map(|_| Fallback::Stalled);
        self.began_with.or_else(stalled)
    }

    /// The inverse or factor that answers are made with now.
    pub(super) fn with_kernel<T>(&self, work: impl FnOnce(&Kernel) -> T) -> T {
        match self.double.get().flatten() {
            Some(double) => work(&double),
            None => work(&self.kernel),
        }
    }

    /// Makes a factor in double precision beside the single one, where there is none yet and memory
    /// allows it; whether answers are of double precision now, and were not before.
    pub(super) fn take_double(&self, stiffness: &Stiffness) -> bool {
        let Kernel::FrontSingle(single) = &self.kernel else { return false };
        if self.double.get().is_some() {
            return false;
        }
        let needed = (single.bytes() + single.analysis().peak_bytes::<f64>()) as u64;
        if needed > self.limit {
            return false;
        }
        let made = self.double.get_or(|| {
            let factor = FrontFactor::try_new(single.analysis(), stiffness).ok()?;
            Some(Arc::new(Kernel::Front(factor)))
        });
        made.is_some()
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
            let found = self.estimate_condition(stiffness);
            match found.is_finite() || !self.take_double(stiffness) {
                true => found,
                false => self.estimate_condition(stiffness),
            }
        });
        Certainty::new(condition, backward_error)
    }

    /// Skeel's condition number by the factor as it is; infinite where refinement with a factor in
    /// single precision comes to a halt.
    fn estimate_condition(&self, stiffness: &Stiffness) -> f64 {
        let apply = |x: &[f64]| self.apply_k11(stiffness, x);
        let weights = row_sums(stiffness, self.partition());
        let n = weights.len();
        self.with_kernel(|kernel| {
            if let Kernel::Multigrid(hierarchy) = kernel {
                let solve = |b: Vec<f64>, _| self.inverse_by_cycles(hierarchy, stiffness, &b);
                return inverse_norm(&weights, &solve);
            }
            inverse_norm(&weights, &|b, columns| {
                refinement::apply_inverse_for_certain(kernel, &apply, b, n, columns)
            })
        })
    }
}

impl Analysed {
    /// Factors on the current rayon pool, in the precision asked for and no other; `on_stage` hears
    /// [`Stage::Factor`].
    ///
    /// `stiffness` must be the one this was analysed from.
    ///
    /// # Errors
    /// [`SolveError::NotPositiveDefinite`] with the node, [`SolveError::OutOfMemory`].
    pub fn factor(
        self,
        stiffness: &Stiffness,
        method: Method,
        on_stage: &mut dyn FnMut(Stage),
    ) -> Result<Factored, SolveError> {
        let kernel = self.kernel(stiffness, method, on_stage)?;
        // Nothing is left for another factor.
        Ok(Factored::of(method, self.into_partition(), kernel, 0))
    }

    /// Factors by this method; where a factor in single precision fails, now or in refinement later, double
    /// precision is taken as far as memory goes, and [`Factored::fallback`] says so.
    ///
    /// Units: `limit` bytes, for all that is held at once.
    ///
    /// # Errors
    /// Those of [`Analysed::factor`], and [`SolveError::OverLimit`].
    pub fn factor_within(
        self,
        stiffness: &Stiffness,
        method: Method,
        limit: u64,
        on_stage: &mut dyn FnMut(Stage),
    ) -> Result<Factored, SolveError> {
        let needed = self.peak_bytes(method);
        if needed > limit {
            let unknown_dofs = self.analysis().row_count();
            return Err(SolveError::OverLimit { method, unknown_dofs, needed, limit });
        }
        let has_room = self.peak_bytes(Method::Front) <= limit;
        let (kernel, began_with) = match self.kernel(stiffness, method, on_stage) {
            Err(SolveError::NotPositiveDefinite { .. }) if method.is_single() && has_room => {
                let double = self.kernel(stiffness, Method::Front, on_stage)?;
                (double, Some(Fallback::NoFactor))
            }
            kernel => (kernel?, None),
        };
        let factored = Factored::of(method, self.into_partition(), kernel, limit);
        Ok(Factored { began_with, ..factored })
    }
}
