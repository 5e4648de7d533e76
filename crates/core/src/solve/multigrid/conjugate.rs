//! Conjugate gradients on `K11`, preconditioned by a hierarchy.

use rayon::prelude::*;

use super::chebyshev::Ritz;
use super::hierarchy::{Hierarchy, Workspace};
use super::small::{PART, dot, norm};
use crate::fem::Stiffness;
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

/// Steps of conjugate gradients on their way.
struct Course<'a> {
    stiffness: &'a Stiffness,
    partition: &'a Partition,
    hierarchy: &'a Hierarchy,
    workspace: Workspace,
    /// The right-hand side, of size one.
    b: Vec<f64>,
    x: Vec<f64>,
    r: Vec<f64>,
    z: Vec<f64>,
    p: Vec<f64>,
    kp: Vec<f64>,
    rho: f64,
    ritz: Ritz,
    steps: u32,
}

/// The iterate with the smallest true residual so far.
struct Best {
    x: Vec<f64>,
    size: f64,
    error: f64,
}

/// Solves `K11 x = b` until residual and estimated error are small enough, the residual falls no more,
/// or the steps are used up.
///
/// Shapes: `b` 3N, zero on known rows; `hierarchy` that of the stiffness and the partition. The
/// direction is kept conjugate in the flexible way, because a cycle in single precision is not exactly
/// a linear operator.
///
/// Source: Hestenes and Stiefel 1952; the flexible form after Golub and Ye 1999.
pub(crate) fn solve(
    stiffness: &Stiffness,
    partition: &Partition,
    hierarchy: &Hierarchy,
    b: &[f64],
    goal: Goal,
) -> Outcome {
    let b_norm = norm(b);
    if b_norm == 0.0 || !b_norm.is_finite() {
        let x = vec![if b_norm == 0.0 { 0.0 } else { f64::NAN }; b.len()];
        let (residual, residual_rel) = (b.to_vec(), b_norm);
        return Outcome { x, residual, residual_rel, error_estimate_rel: b_norm, steps: 0 };
    }
    let b: Vec<f64> = b.iter().map(|b| b / b_norm).collect();
    let mut course = Course::new(stiffness, partition, hierarchy, b);
    let mut best = Best { x: course.x.clone(), size: 1.0, error: f64::INFINITY };
    let mut stale = 0;
    let reached = |best: &Best| best.size <= goal.residual_rel && best.error <= goal.error_rel;
    while !reached(&best) && course.steps < goal.steps_max && stale < STALE_MAX {
        if !course.step() {
            break;
        }
        let carried = norm(&course.r);
        let is_near = carried <= goal.residual_rel && course.error_estimate_rel() <= goal.error_rel;
        let is_last = course.steps == goal.steps_max;
        let is_due = carried <= 0.1 * best.size || course.steps.is_multiple_of(TRUE_EVERY);
        if is_near || is_due || is_last {
            // The recurrence drifts from the true residual; only the true one may end the loop.
            let size = course.find_residual();
            let error = course.error_estimate_rel();
            stale = if size <= DRIFTED * carried { 0 } else { stale + 1 };
            if size < best.size || (size <= goal.residual_rel && error < best.error) {
                best.x.copy_from_slice(&course.x);
                (best.size, best.error) = (size, error);
            }
        }
    }
    course.x.copy_from_slice(&best.x);
    course.find_residual();
    let scaled = |v: &[f64]| v.iter().map(|v| v * b_norm).collect();
    Outcome {
        x: scaled(&course.x),
        residual: scaled(&course.r),
        residual_rel: best.size,
        error_estimate_rel: best.error,
        steps: course.steps,
    }
}

impl<'a> Course<'a> {
    fn new(
        stiffness: &'a Stiffness,
        partition: &'a Partition,
        hierarchy: &'a Hierarchy,
        b: Vec<f64>,
    ) -> Self {
        let zeros = || vec![0.0; b.len()];
        let (x, r, z, p, kp) = (zeros(), b.clone(), zeros(), zeros(), zeros());
        let (workspace, ritz) = (hierarchy.workspace(), Ritz::default());
        let (rho, steps) = (0.0, 0);
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
            rho,
            ritz,
            steps,
        };
        this.precondition();
        this.rho = dot(&this.r, &this.z);
        this.p.copy_from_slice(&this.z);
        this
    }

    fn precondition(&mut self) {
        self.hierarchy.apply(&self.r, &mut self.z, &mut self.workspace);
    }

    /// One step; `false` where rounding leaves no direction.
    fn step(&mut self) -> bool {
        multiply(self.stiffness, self.partition, &self.p, &mut self.kp);
        let curvature = dot(&self.p, &self.kp);
        let alpha = self.rho / curvature;
        if !(curvature > 0.0 && alpha > 0.0 && alpha.is_finite()) {
            return false;
        }
        let Self { x, r, p, kp, .. } = self;
        let of_x = x.par_chunks_mut(PART).zip(p.par_chunks(PART));
        let of_r = r.par_chunks_mut(PART).zip(kp.par_chunks(PART));
        of_x.zip(of_r).for_each(|((x, p), (r, kp))| {
            x.iter_mut().zip(p).for_each(|(x, p)| *x += alpha * p);
            r.iter_mut().zip(kp).for_each(|(r, kp)| *r -= alpha * kp);
        });
        self.steps += 1;
        self.precondition();
        let rho = dot(&self.r, &self.z);
        // zᵀ(r − r before) = −α zᵀ K p.
        let beta = -alpha * dot(&self.z, &self.kp) / self.rho;
        self.ritz.step(alpha, rho / self.rho);
        self.rho = rho;
        self.p.par_chunks_mut(PART).zip(self.z.par_chunks(PART)).for_each(|(p, z)| {
            p.iter_mut().zip(z).for_each(|(p, z)| *p = z + beta * *p);
        });
        rho > 0.0
    }

    /// Puts the true residual in the place of the one that was carried along; its size.
    fn find_residual(&mut self) -> f64 {
        multiply(self.stiffness, self.partition, &self.x, &mut self.r);
        self.r.par_chunks_mut(PART).zip(self.b.par_chunks(PART)).for_each(|(r, b)| {
            r.iter_mut().zip(b).for_each(|(r, b)| *r = b - *r);
        });
        norm(&self.r)
    }

    /// Estimate of `‖error‖ / ‖x‖`.
    fn error_estimate_rel(&self) -> f64 {
        let smallest = self.ritz.smallest().unwrap_or(0.0).min(1.0);
        ESTIMATE_SAFETY * norm(&self.z) / (smallest * norm(&self.x))
    }
}

/// `K11 p` with zeros on known rows.
fn multiply(stiffness: &Stiffness, partition: &Partition, p: &[f64], kp: &mut [f64]) {
    stiffness.mul_into(p, kp);
    for &known in partition.known() {
        kp[known as usize] = 0.0;
    }
}
