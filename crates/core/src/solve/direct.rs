//! One interface to all direct methods: factor a partition once, then answer known displacements.

use super::certainty::backward_error;
use super::front::FrontFactor;
use super::k11::{SparseK11, right_hand_side, visit_k11};
use super::partition::AXIS_NAMES;
use super::pcg::{self, PcgParams, norm};
use super::pivot::NotPositive;
use super::sparse::{Analysis, SparseFactor};
use super::tiles::Tiles;
use super::worked_out::WorkedOut;
use super::{Method, Partition, Stage, gauss_jordan, gauss_jordan_plain, ordering};
use crate::fem::Stiffness;

mod analysed;
mod refinement;

pub use analysed::{Analysed, FrontMethod};
use refinement::Judged;

/// `K11` of one partition, inverted or factored by one method.
///
/// Source: thesis (3.43a).
pub struct Factored {
    method: Method,
    partition: Partition,
    kernel: Kernel,
    /// Skeel's condition number, once somebody has asked for it.
    pub(super) condition: WorkedOut<f64>,
}

enum Kernel {
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

fn not_positive(method: Method, partition: &Partition, row: usize) -> SolveError {
    let dof = partition.unknown().get(row).map_or(0, |&d| d as usize);
    let (node, axis) = (dof / 3, AXIS_NAMES[dof % 3]);
    SolveError::NotPositiveDefinite { method, node, axis }
}

/// Known displacements and external forces of one answer.
///
/// Shapes: `q_known` one per known degree of freedom of the partition, in its order; `forces`
/// empty or 3N (entries on known degrees of freedom must be zero). Units: m, N.
#[derive(Clone, Copy, Debug, Default)]
pub struct Loads<'a> {
    /// `Q_k`.
    pub q_known: &'a [f64],
    /// `f₁` of (3.7), scattered over all degrees of freedom.
    pub forces: &'a [f64],
    /// Relative residual and estimated relative error that are good enough, both, for a method that
    /// can stop early ([`Method::Pcg`]); zero asks for all there is.
    pub residual_rel: f64,
}

/// Displacements, reactions and how exact they are.
#[derive(Clone, Debug, PartialEq)]
pub struct Solution {
    /// Displacement of every degree of freedom, 3N, m; zero at orphan nodes.
    pub displacement: Vec<f64>,
    /// Reaction `F_u` (3.43b) of every known degree of freedom, in the partition's order, N.
    pub reaction: Vec<f64>,
    /// `‖K11 Q_u − b‖₂ / ‖b‖₂`, zero when `b` is.
    pub residual_rel: f64,
    /// Componentwise backward error of the free rows: see [`Factored::certainty`].
    pub backward_error: f64,
    /// Estimate of `‖error‖ / ‖Q_u‖` where a method stops by it ([`Method::Pcg`]); no bound.
    pub error_estimate_rel: Option<f64>,
    /// Refinement steps taken.
    pub refinement_steps: u32,
}

/// Why there is no answer.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum SolveError {
    /// A pivot of `K11` was not positive.
    #[error(
        "{method}: the stiffness of the free nodes is not positive definite at node {node} axis \
         {axis}: the known displacements leave a motion free, or an element there is degenerate"
    )]
    NotPositiveDefinite {
        /// Method that found it.
        method: Method,
        /// Node of the pivot.
        node: usize,
        /// Axis of the pivot.
        axis: char,
    },
    /// A method that has no factor of `K11`.
    #[error("{method} does not factor the stiffness of the free nodes")]
    NotDirect {
        /// The method.
        method: Method,
    },
    /// Memory for the factor could not be had.
    #[error("{method}: no memory for the factor of {unknown_dofs} unknowns")]
    OutOfMemory {
        /// Method that asked.
        method: Method,
        /// Size of `K11`.
        unknown_dofs: usize,
    },
    /// The factor or inverse is larger than it may be.
    #[error(
        "{method}: the factor or inverse of {unknown_dofs} unknowns takes up to {needed} bytes while \
         it is made, and may take {limit}"
    )]
    OverLimit {
        /// Method that asked.
        method: Method,
        /// Size of `K11`.
        unknown_dofs: usize,
        /// Bytes it would take at most.
        needed: u64,
        /// Bytes it may take.
        limit: u64,
    },
    /// The answer holds NaN or infinity.
    #[error(
        "{method}: the answer is not finite; the numbers of the mesh, the material or the known \
         displacements are too large or too small for double precision"
    )]
    NotFinite {
        /// Method used.
        method: Method,
    },
    /// Loads that do not fit the partition.
    #[error("{given} values for {expected} {what}")]
    LoadCount {
        /// Which list.
        what: &'static str,
        /// Values given.
        given: usize,
        /// Values expected.
        expected: usize,
    },
}

/// Refinement and conjugate gradients stop at this relative residual.
const RESIDUAL_GOOD: f64 = 1e-13;
/// Refinement stops at this backward error; one step more would only move the last bits.
const BACKWARD_ERROR_GOOD: f64 = 1e-13;
/// Conjugate gradients stop after this many steps in any case.
const PCG_STEPS_MAX: u32 = 500;

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
        if method == Method::Condensed {
            return Err(SolveError::NotDirect { method });
        }
        check(method.dense_bytes(n).unwrap_or(0))?;
        let not_positive = |error: NotPositive| not_positive(method, &partition, error.row);
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
            Method::Front | Method::FrontMixed | Method::Pcg | Method::Condensed => {
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
        let n = self.partition.unknown().len();
        match &self.kernel {
            Kernel::Inverse(values) => std::mem::size_of_val(values.as_slice()),
            Kernel::TiledInverse(_) | Kernel::TiledFactor(_) => 4 * n * n,
            Kernel::Sparse(factor) => factor.bytes(),
            Kernel::Front(factor) => factor.bytes(),
            Kernel::FrontSingle(factor) => factor.bytes(),
        }
    }

    /// Displacements and reactions for one set of loads: (3.43a) and (3.43b), refined while the
    /// residual falls.
    ///
    /// `stiffness` must be the one this was factored from.
    ///
    /// # Errors
    /// [`SolveError::LoadCount`], [`SolveError::NotFinite`].
    ///
    /// Source: thesis (3.43), (3.7).
    pub fn solve(
        &self,
        stiffness: &Stiffness,
        loads: Loads<'_>,
        on_stage: &mut dyn FnMut(Stage),
    ) -> Result<Solution, SolveError> {
        on_stage(Stage::Solve);
        self.check(loads)?;
        let partition = &self.partition;
        let b = right_hand_side(stiffness, partition, loads.q_known, loads.forces);
        let b_norm = norm(&b);
        let mut q = vec![0.0; partition.dof_count()];
        for (&dof, &value) in partition.known().iter().zip(loads.q_known) {
            q[dof as usize] = value;
        }
        let mut x = match self.method {
            Method::Pcg => vec![0.0; b.len()],
            _ => self.apply_inverse(b.clone()),
        };
        let mut refinement_steps = 0;
        let mut error_estimate_rel = None;
        let apply = |x: &[f64]| self.apply_k11(stiffness, x);
        let mut residual = subtract(&b, &apply(&x));
        let mut judge = |x: &[f64], residual: &[f64]| {
            scatter(partition, x, &mut q);
            let backward_error = backward_error(stiffness, partition, &q, residual, loads.forces);
            let (backward, size) = (backward_error / BACKWARD_ERROR_GOOD, norm(residual));
            let off = if size > 0.0 { backward.max(size / (RESIDUAL_GOOD * b_norm)) } else { 0.0 };
            Judged { backward_error, off }
        };
        let mut judged = None;
        if self.method != Method::Pcg {
            let (steps, last) = self.refine(&apply, &mut judge, &b, &mut x, &mut residual);
            (refinement_steps, judged) = (steps, Some(last));
        }
        // A single-precision factor that refinement cannot use any more still preconditions well.
        let single = matches!(self.kernel, Kernel::FrontSingle(_));
        if single && norm(&residual) > RESIDUAL_GOOD.max(loads.residual_rel) * b_norm {
            let params = PcgParams {
                residual_rel: RESIDUAL_GOOD.max(loads.residual_rel),
                // Without an error to reach the residual decides alone.
                error_rel: Some(loads.residual_rel).filter(|e| *e > 0.0).unwrap_or(f64::INFINITY),
                steps_max: PCG_STEPS_MAX,
            };
            let precondition = |r: &[f64]| self.apply_inverse(r.to_vec());
            let reached = pcg::solve(&apply, &precondition, &b, &mut x, params);
            residual = reached.residual;
            refinement_steps += reached.steps;
            error_estimate_rel = Some(reached.error_estimate_rel);
            judged = None;
        }
        let Judged { backward_error, .. } = judged.unwrap_or_else(|| judge(&x, &residual));
        // What was judged last need not be what was taken.
        scatter(partition, &x, &mut q);
        let f = stiffness.mul(&q);
        if !q.iter().all(|x| x.is_finite()) {
            return Err(SolveError::NotFinite { method: self.method });
        }
        let reaction = partition.known().iter().map(|&dof| f[dof as usize]).collect();
        let residual_rel = if b_norm > 0.0 { norm(&residual) / b_norm } else { norm(&residual) };
        Ok(Solution {
            displacement: q,
            reaction,
            residual_rel,
            backward_error,
            error_estimate_rel,
            refinement_steps,
        })
    }

    /// `K11 x`, through the whole stiffness with zeros at the known degrees of freedom.
    fn apply_k11(&self, stiffness: &Stiffness, x: &[f64]) -> Vec<f64> {
        let unknown = self.partition.unknown();
        let mut q = vec![0.0; self.partition.dof_count()];
        scatter(&self.partition, x, &mut q);
        let f = stiffness.mul(&q);
        unknown.iter().map(|&dof| f[dof as usize]).collect()
    }

    fn check(&self, loads: Loads<'_>) -> Result<(), SolveError> {
        let expected = self.partition.known().len();
        if loads.q_known.len() != expected {
            let given = loads.q_known.len();
            return Err(SolveError::LoadCount { what: "known displacements", given, expected });
        }
        let expected = self.partition.dof_count();
        if !loads.forces.is_empty() && loads.forces.len() != expected {
            let given = loads.forces.len();
            return Err(SolveError::LoadCount { what: "external forces", given, expected });
        }
        Ok(())
    }

    /// `K11⁻¹ B` for columns of n, one behind the other.
    pub(super) fn apply_inverse_to_columns(&self, mut b: Vec<f64>, columns: usize) -> Vec<f64> {
        match &self.kernel {
            Kernel::Front(factor) => {
                factor.solve_in_place(&mut b, columns);
                b
            }
            _ => {
                let n = self.partition.unknown().len().max(1);
                b.chunks(n).flat_map(|b| self.apply_inverse(b.to_vec())).collect()
            }
        }
    }

    /// `K11⁻¹ b`.
    fn apply_inverse(&self, mut b: Vec<f64>) -> Vec<f64> {
        match &self.kernel {
            Kernel::Inverse(inverse) => gauss_jordan::mul(inverse, &b),
            Kernel::TiledInverse(inverse) => inverse.mul(&b),
            Kernel::TiledFactor(factor) => {
                factor.solve_in_place(&mut b);
                b
            }
            Kernel::Sparse(factor) => {
                factor.solve_in_place(&mut b);
                b
            }
            Kernel::Front(factor) => {
                factor.solve_in_place(&mut b, 1);
                b
            }
            Kernel::FrontSingle(factor) => {
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

/// Writes the unknown displacements to their places among all.
fn scatter(partition: &Partition, x: &[f64], q: &mut [f64]) {
    for (&dof, x) in partition.unknown().iter().zip(x) {
        q[dof as usize] = *x;
    }
}

fn subtract(a: &[f64], b: &[f64]) -> Vec<f64> {
    a.iter().zip(b).map(|(a, b)| a - b).collect()
}

#[cfg(test)]
mod tests;
