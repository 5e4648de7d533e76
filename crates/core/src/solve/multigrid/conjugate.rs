//! Conjugate gradients on `K11`, preconditioned by a hierarchy: for one right-hand side, or for several that
//! share every pass over matrix and hierarchy.

use rayon::prelude::*;

use super::chebyshev::Ritz;
use super::hierarchy::{Hierarchy, Workspace};
use super::small::{PART, dots, norms};
use crate::fem::{Stiffness, forces_of_columns};
use crate::solve::Partition;

/// Residual and error at which conjugate gradients stop.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Goal {
    /// `‖b − K11 x‖ / ‖b‖` to reach.
    pub residual_rel: f64,
    /// Estimate of `‖error‖ / ‖x‖` to reach as well.
    pub error_rel: f64,
    /// Steps at most.
    pub steps_max: u32,
}

/// Answer of conjugate gradients, and how good it is.
pub(crate) struct Outcome {
    /// The answer, 3N, zero on known rows.
    pub x: Vec<f64>,
    /// `b − K11 x`, 3N, zero on known rows.
    pub residual: Vec<f64>,
    /// `‖b − K11 x‖ / ‖b‖`.
    pub residual_rel: f64,
    /// Estimate of `‖error‖ / ‖x‖`.
    pub error_estimate_rel: f64,
    /// Steps of conjugate gradients.
    pub steps: u32,
}

/// The error is `(M K11)⁻¹ M r` for the preconditioner `M`, so `M r` over the smallest eigenvalue of
/// `M K11` covers it in the preconditioner's norm. The eigenvalue is seen from above, and the norm is
/// Euclid's: a factor that is meant to cover both.
const ESTIMATE_SAFETY: f64 = 2.0;
/// A true residual this far above the one that was carried along has come to its end in rounding, if it
/// is found so a few times running.
const DRIFTED: f64 = 2.0;
const STALE_MAX: u32 = 3;
/// The true residual is looked at least this often.
const TRUE_EVERY: u32 = 20;

/// Right-hand sides that are worked on together at most: the numbers of one row then fill the registers, and
/// the vectors stay small beside the matrix.
pub(crate) const TOGETHER: usize = 8;

/// Steps of conjugate gradients on their way, for W right-hand sides: each has directions and lengths of its
/// own, and stays where it is once it has ended.
///
/// Shapes: vectors 3N × W, the numbers of one degree of freedom next to each other.
struct Course<'a, const W: usize> {
    stiffness: &'a Stiffness,
    partition: &'a Partition,
    hierarchy: &'a Hierarchy,
    workspace: Workspace<W>,
    /// The right-hand sides, of size one.
    b: Vec<f64>,
    x: Vec<f64>,
    r: Vec<f64>,
    z: Vec<f64>,
    p: Vec<f64>,
    kp: Vec<f64>,
    /// The iterates with the smallest true residuals so far.
    best: Vec<f64>,
    columns: [Column; W],
    steps: u32,
}

/// What is known of one right-hand side.
struct Column {
    goal: Goal,
    /// Size of the right-hand side as it was given.
    b_norm: f64,
    rho: f64,
    ritz: Ritz,
    /// True residual and estimated error of the best iterate.
    size: f64,
    error: f64,
    stale: u32,
    steps: u32,
    /// Whether steps are still taken.
    is_open: bool,
}

/// Solves `K11 x = b` for some right-hand sides, each until residual and estimated error are small enough,
/// the residual falls no more, or the steps are used up.
///
/// Shapes: each `b` 3N, zero on known rows; `hierarchy` that of the stiffness and the partition. The
/// direction is kept conjugate in the flexible way, because a cycle in single precision is not exactly
/// a linear operator. Alone a right-hand side has other last bits than beside others.
///
/// Source: Hestenes and Stiefel 1952; the flexible form after Golub and Ye 1999.
pub(crate) fn solve(
    stiffness: &Stiffness,
    partition: &Partition,
    hierarchy: &Hierarchy,
    asked: &[(Vec<f64>, Goal)],
) -> Vec<Outcome> {
    let system = (stiffness, partition, hierarchy);
    let (mut found, mut rest) = (Vec::with_capacity(asked.len()), asked);
    while !rest.is_empty() {
        let (some, others) = rest.split_at(width(rest.len()).min(rest.len()));
        found.extend(match width(rest.len()) {
            1 => Course::<1>::solve(system, some),
            2 => Course::<2>::solve(system, some),
            4 => Course::<4>::solve(system, some),
            _ => Course::<TOGETHER>::solve(system, some),
        });
        rest = others;
    }
    found
}

/// Solves `K11 x = b` for columns of n, one behind the other, all to one goal; each answer as in [`solve`].
///
/// Shapes: `b` n for each column, in the order of the unknown degrees of freedom.
pub(crate) fn solve_columns(
    stiffness: &Stiffness,
    partition: &Partition,
    hierarchy: &Hierarchy,
    b: &[f64],
    goal: Goal,
) -> Vec<Outcome> {
    let posed = |b: &[f64]| {
        let mut all = vec![0.0; partition.dof_count()];
        partition.scatter_unknown(b, &mut all);
        (all, goal)
    };
    let columns = b.chunks(partition.unknown().len().max(1));
    let asked: Vec<(Vec<f64>, Goal)> = columns.map(posed).collect();
    solve(stiffness, partition, hierarchy, &asked)
}

/// Error to which a digit is known, and the steps that are taken for it at most.
const DIGIT: Goal = Goal { residual_rel: 1.0, error_rel: 0.1, steps_max: 1000 };

/// `K11⁻¹ B` to a digit at least, for columns of n, one behind the other; no number where a digit is not
/// reached.
pub(crate) fn inverse_to_a_digit(
    stiffness: &Stiffness,
    partition: &Partition,
    hierarchy: &Hierarchy,
    b: &[f64],
) -> Vec<f64> {
    let found = solve_columns(stiffness, partition, hierarchy, b, DIGIT);
    let of_column = |found: Outcome| {
        let is_digit = found.error_estimate_rel <= DIGIT.error_rel;
        let x = partition.unknown().iter().map(|&dof| found.x[dof as usize]);
        x.map(|x| if is_digit { x } else { f64::NAN }).collect::<Vec<f64>>()
    };
    found.into_iter().flat_map(of_column).collect()
}

/// How many of so many right-hand sides are worked on next: at most one place stays empty.
fn width(count: usize) -> usize {
    match count {
        0 | 1 => 1,
        2 => 2,
        3..=6 => 4,
        _ => TOGETHER,
    }
}

impl Column {
    fn new(b: &[f64], goal: Goal) -> Self {
        let [b_norm] = norms::<1>(b);
        let (ritz, error) = (Ritz::default(), f64::INFINITY);
        let is_open = b_norm > 0.0 && b_norm.is_finite() && goal.steps_max > 0;
        Self { goal, b_norm, rho: 0.0, ritz, size: 1.0, error, stale: 0, steps: 0, is_open }
    }

    /// A place that nobody has asked for.
    fn empty() -> Self {
        Self::new(&[], Goal { residual_rel: 1.0, error_rel: 1.0, steps_max: 0 })
    }

    /// Whether there is anything to solve.
    fn is_posed(&self) -> bool {
        self.b_norm > 0.0 && self.b_norm.is_finite()
    }

    /// Length of a step along a direction of this curvature; zero where rounding leaves no direction, or
    /// none is wanted.
    fn length(&mut self, curvature: f64) -> f64 {
        let alpha = self.rho / curvature;
        self.is_open &= curvature > 0.0 && alpha > 0.0 && alpha.is_finite();
        if self.is_open { alpha } else { 0.0 }
    }

    /// Whether the true residual is to be looked at in any case, where the one that is carried along has
    /// this size.
    fn is_due(&self, carried: f64) -> bool {
        let is_last = self.steps == self.goal.steps_max;
        let is_smaller = carried <= 0.1 * self.size || self.steps.is_multiple_of(TRUE_EVERY);
        self.is_open && (is_smaller || is_last)
    }

    /// Takes the true residual and the estimated error; whether the iterate is the best so far.
    fn see(&mut self, (carried, size): (f64, f64), error: f64) -> bool {
        self.stale = if size <= DRIFTED * carried { 0 } else { self.stale + 1 };
        let Goal { residual_rel, error_rel, steps_max } = self.goal;
        let is_best = size < self.size || (size <= residual_rel && error < self.error);
        if is_best {
            (self.size, self.error) = (size, error);
        }
        let is_reached = self.size <= residual_rel && self.error <= error_rel;
        self.is_open = !is_reached && self.steps < steps_max && self.stale < STALE_MAX;
        is_best
    }

    /// Estimate of `‖error‖ / ‖x‖` from the norms of the preconditioned residual and of the iterate.
    fn error_estimate_rel(&self, z_norm: f64, x_norm: f64) -> f64 {
        let smallest = self.ritz.smallest().unwrap_or(0.0).min(1.0);
        ESTIMATE_SAFETY * z_norm / (smallest * x_norm)
    }
}

impl<'a, const W: usize> Course<'a, W> {
    /// Answers of at most W right-hand sides.
    fn solve(
        system: (&'a Stiffness, &'a Partition, &'a Hierarchy),
        asked: &[(Vec<f64>, Goal)],
    ) -> Vec<Outcome> {
        let mut course = Self::new(system, asked);
        while course.step() {
            let carried = norms::<W>(&course.r);
            if course.is_due(carried) {
                course.look(carried);
            }
        }
        course.x.copy_from_slice(&course.best);
        course.find_residual();
        asked.iter().enumerate().map(|(w, (b, _))| course.outcome(w, b)).collect()
    }

    fn new(
        (stiffness, partition, hierarchy): (&'a Stiffness, &'a Partition, &'a Hierarchy),
        asked: &[(Vec<f64>, Goal)],
    ) -> Self {
        let columns: [Column; W] = std::array::from_fn(|w| match asked.get(w) {
            Some((b, goal)) => Column::new(b, *goal),
            None => Column::empty(),
        });
        let mut b = vec![0.0; W * partition.dof_count()];
        b.par_chunks_mut(PART * W).enumerate().for_each(|(part, rows)| {
            for (k, row) in rows.as_chunks_mut::<W>().0.iter_mut().enumerate() {
                for ((row, (b, _)), column) in row.iter_mut().zip(asked).zip(&columns) {
                    if column.is_posed() {
                        *row = b[part * PART + k] / column.b_norm;
                    }
                }
            }
        });
        let zeros = || vec![0.0; b.len()];
        let (x, z, p, kp, best, r) = (zeros(), zeros(), zeros(), zeros(), zeros(), b.clone());
        let workspace = hierarchy.workspace();
        let mut this = Self {
            stiffness,
            partition,
            hierarchy,
            workspace,
            b,
            x,
            r,
            z,
            p,
            kp,
            best,
            columns,
            steps: 0,
        };
        this.precondition();
        let rho = dots::<W>(&this.r, &this.z);
        this.columns.iter_mut().zip(rho).for_each(|(column, rho)| column.rho = rho);
        this.p.copy_from_slice(&this.z);
        this
    }

    fn precondition(&mut self) {
        self.hierarchy.apply(&self.r, &mut self.z, &mut self.workspace);
    }

    /// One step of all that are open; `false` where none is left.
    fn step(&mut self) -> bool {
        if !self.columns.iter().any(|column| column.is_open) {
            return false;
        }
        multiply::<W>(self.stiffness, self.partition, &self.p, &mut self.kp);
        let curvature = dots::<W>(&self.p, &self.kp);
        let columns = &mut self.columns;
        let alpha: [f64; W] = std::array::from_fn(|w| columns[w].length(curvature[w]));
        if !columns.iter().any(|column| column.is_open) {
            return false;
        }
        let Self { x, r, p, kp, .. } = self;
        let of_x = x.par_chunks_mut(PART).zip(p.par_chunks(PART));
        let of_r = r.par_chunks_mut(PART).zip(kp.par_chunks(PART));
        of_x.zip(of_r).for_each(|((x, p), (r, kp))| {
            for (x, p) in x.as_chunks_mut::<W>().0.iter_mut().zip(p.as_chunks::<W>().0) {
                (0..W).for_each(|w| x[w] += alpha[w] * p[w]);
            }
            for (r, kp) in r.as_chunks_mut::<W>().0.iter_mut().zip(kp.as_chunks::<W>().0) {
                (0..W).for_each(|w| r[w] -= alpha[w] * kp[w]);
            }
        });
        self.steps += 1;
        self.turn(alpha);
        self.columns.iter().any(|column| column.is_open)
    }

    /// The next directions, after steps of these lengths.
    fn turn(&mut self, alpha: [f64; W]) {
        self.precondition();
        let rho = dots::<W>(&self.r, &self.z);
        // zᵀ(r − r before) = −α zᵀ K p.
        let change = dots::<W>(&self.z, &self.kp);
        let mut beta = [0.0; W];
        for (w, column) in self.columns.iter_mut().enumerate().filter(|(_, c)| c.is_open) {
            column.steps += 1;
            beta[w] = -alpha[w] * change[w] / column.rho;
            column.ritz.step(alpha[w], rho[w] / column.rho);
            column.rho = rho[w];
            column.is_open = rho[w] > 0.0;
        }
        let is_open: [bool; W] = std::array::from_fn(|w| self.columns[w].is_open);
        self.p.par_chunks_mut(PART).zip(self.z.par_chunks(PART)).for_each(|(p, z)| {
            for (p, z) in p.as_chunks_mut::<W>().0.iter_mut().zip(z.as_chunks::<W>().0) {
                for w in 0..W {
                    // What has ended has no direction, whatever stands in its residual.
                    p[w] = if is_open[w] { z[w] + beta[w] * p[w] } else { 0.0 };
                }
            }
        });
    }

    /// Whether one of those that are open may have come to its goal, or is due for another reason.
    fn is_due(&self, carried: [f64; W]) -> bool {
        let open = || self.columns.iter().enumerate().filter(|(_, column)| column.is_open);
        if open().any(|(w, column)| column.is_due(carried[w])) {
            return true;
        }
        let is_near = |w: usize, column: &Column| carried[w] <= column.goal.residual_rel;
        if !open().any(|(w, column)| is_near(w, column)) {
            return false;
        }
        let errors = self.error_estimates_rel();
        open().any(|(w, column)| is_near(w, column) && errors[w] <= column.goal.error_rel)
    }

    /// Estimates of `‖error‖ / ‖x‖`.
    fn error_estimates_rel(&self) -> [f64; W] {
        let (z, x) = (norms::<W>(&self.z), norms::<W>(&self.x));
        std::array::from_fn(|w| self.columns[w].error_estimate_rel(z[w], x[w]))
    }

    /// Looks at the true residuals: the recurrence drifts from them, and only they may end the steps.
    fn look(&mut self, carried: [f64; W]) {
        let errors = self.error_estimates_rel();
        self.find_residual();
        let sizes = norms::<W>(&self.r);
        let mut is_best = [false; W];
        for (w, column) in self.columns.iter_mut().enumerate().filter(|(_, c)| c.is_open) {
            is_best[w] = column.see((carried[w], sizes[w]), errors[w]);
        }
        self.best.par_chunks_mut(PART).zip(self.x.par_chunks(PART)).for_each(|(best, x)| {
            for (best, x) in best.as_chunks_mut::<W>().0.iter_mut().zip(x.as_chunks::<W>().0) {
                (0..W).filter(|&w| is_best[w]).for_each(|w| best[w] = x[w]);
            }
        });
    }

    /// Puts the true residuals in the place of those that were carried along.
    fn find_residual(&mut self) {
        multiply::<W>(self.stiffness, self.partition, &self.x, &mut self.r);
        self.r.par_chunks_mut(PART).zip(self.b.par_chunks(PART)).for_each(|(r, b)| {
            r.iter_mut().zip(b).for_each(|(r, b)| *r = b - *r);
        });
    }

    /// The answer of one right-hand side.
    fn outcome(&self, w: usize, b: &[f64]) -> Outcome {
        let column = &self.columns[w];
        let b_norm = column.b_norm;
        if !column.is_posed() {
            let x = vec![if b_norm == 0.0 { 0.0 } else { f64::NAN }; b.len()];
            let (residual, residual_rel) = (b.to_vec(), b_norm);
            return Outcome { x, residual, residual_rel, error_estimate_rel: b_norm, steps: 0 };
        }
        let scaled = |v: &[f64]| v.iter().skip(w).step_by(W).map(|v| v * b_norm).collect();
        Outcome {
            x: scaled(&self.x),
            residual: scaled(&self.r),
            residual_rel: column.size,
            error_estimate_rel: column.error,
            steps: column.steps,
        }
    }
}

/// `K11 p` with zeros on known rows.
fn multiply<const W: usize>(
    stiffness: &Stiffness,
    partition: &Partition,
    p: &[f64],
    kp: &mut [f64],
) {
    match W {
        1 => stiffness.mul_into(p, kp),
        _ => forces_of_columns(stiffness, p, W, kp),
    }
    for &known in partition.known() {
        kp[W * known as usize..][..W].fill(0.0);
    }
}
