//! Refines direct answers, and solves to a digit at least, whatever the factor's precision.

use super::kernel::Kernel;
use crate::solve::vectors::{norm, subtract};

/// Refinement stops after this many steps in any case.
const REFINEMENT_STEPS_MAX: u32 = 3;
/// Most steps of refinement with a single-precision factor, which gains four to seven digits a step.
const REFINEMENT_STEPS_SINGLE_MAX: u32 = 8;
/// Refinement and conjugate gradients stop at this relative residual.
pub(super) const RESIDUAL_GOOD: f64 = 1e-13;
/// Refinement stops at this backward error; one step more would only move the last bits.
const BACKWARD_ERROR_GOOD: f64 = 1e-13;

/// Corrections that a kernel's answers are worth.
pub(super) fn steps_max(kernel: &Kernel) -> u32 {
    match kernel.is_single() {
        true => REFINEMENT_STEPS_SINGLE_MAX,
        // The first answer of a factor in double precision is as good as corrections make it.
        false => REFINEMENT_STEPS_MAX,
    }
}

/// How good an answer is.
pub(super) struct Judged {
    /// Componentwise backward error.
    pub backward_error: f64,
    /// How far it is from good, at most one if it is: by backward error and by residual.
    pub off: f64,
}

impl Judged {
    /// Units: both norms those of the right-hand side.
    pub(super) fn new(backward_error: f64, residual_norm: f64, b_norm: f64) -> Self {
        let backward = backward_error / BACKWARD_ERROR_GOOD;
        let residual = residual_norm / (RESIDUAL_GOOD * b_norm);
        let off = if residual_norm > 0.0 { backward.max(residual) } else { 0.0 };
        Self { backward_error, off }
    }
}

/// How fast the corrections of an answer by a single-precision factor shrink: a residual can be
/// small while a smooth error, which makes little force, is not.
///
/// Units: relative to the answer.
pub(super) struct Shrinking {
    /// Size of the last correction.
    last: f64,
    /// What the next one would be, if it shrank as the last one did.
    next: f64,
}

/// A correction this large that shrinks no more leaves hardly a digit of the answer.
const CORRECTION_STALLED: f64 = 1e-3;
/// A next correction this small is not made.
const CORRECTION_GOOD: f64 = 1e-13;

impl Shrinking {
    /// Nothing is seen yet: at least one correction is made.
    pub(super) const UNSEEN: Self = Self { last: 1.0, next: f64::INFINITY };

    pub(super) fn see(&mut self, size: f64) {
        self.next = match size < 0.5 * self.last {
            true => size * size / self.last,
            // It shrinks no more, or is no number.
            false => 0.0,
        };
        self.last = size;
    }

    /// Whether corrections that are still large shrink no more: the factor is that of another
    /// matrix.
    pub(super) fn has_stalled(&self) -> bool {
        self.next == 0.0 && !matches!(self.last, 0.0..=CORRECTION_STALLED)
    }

    pub(super) fn is_done(&self) -> bool {
        self.next <= CORRECTION_GOOD
    }
}

/// The refinement of one answer.
pub(super) struct Course {
    /// What was found of the answer as it is.
    pub judged: Judged,
    /// Corrections that were added to the answer.
    pub steps: u32,
    /// How the corrections shrink; `None` for a factor in double precision.
    shrinking: Option<Shrinking>,
}

impl Course {
    pub(super) fn new(kernel: &Kernel, first: Judged) -> Self {
        let shrinking = kernel.is_single().then_some(Shrinking::UNSEEN);
        Self { judged: first, steps: 0, shrinking }
    }

    /// Whether the answer is good, and no further correction would change it.
    pub(super) fn is_good(&self) -> bool {
        self.judged.off <= 1.0 && self.shrinking.as_ref().is_none_or(Shrinking::is_done)
    }

    /// Looks at a correction and the answer with it; whether that one is taken.
    ///
    /// Units: `size_rel` relative to the answer.
    pub(super) fn takes(&mut self, after: Judged, size_rel: impl FnOnce() -> f64) -> bool {
        // Of good answers a single-precision factor's later one is taken; a NaN is refused too.
        let mut enough = self.judged.off;
        if let Some(shrinking) = &mut self.shrinking {
            enough = enough.max(1.0);
            shrinking.see(size_rel());
        }
        if after.off >= enough || after.off.is_nan() {
            return false;
        }
        self.judged = after;
        self.steps += 1;
        true
    }

    /// Whether corrections by a single-precision factor stayed large.
    pub(super) fn has_stalled(&self) -> bool {
        self.shrinking.as_ref().is_some_and(Shrinking::has_stalled)
    }
}

/// Improves `x` until it is judged good or gets no better.
pub(super) fn refine(
    kernel: &Kernel,
    apply: &dyn Fn(&[f64]) -> Vec<f64>,
    judge: &mut dyn FnMut(&[f64], &[f64]) -> Judged,
    b: &[f64],
    x: &mut Vec<f64>,
    residual: &mut Vec<f64>,
) -> Course {
    let mut course = Course::new(kernel, judge(x, residual));
    for _ in 0..steps_max(kernel) {
        if course.is_good() {
            break;
        }
        let correction = kernel.apply(residual.clone());
        let refined: Vec<f64> = x.iter().zip(&correction).map(|(x, c)| x + c).collect();
        let refined_residual = subtract(b, &apply(&refined));
        let after = judge(&refined, &refined_residual);
        if !course.takes(after, || norm(&correction) / norm(&refined)) {
            break;
        }
        (*x, *residual) = (refined, refined_residual);
    }
    course
}

/// `K11⁻¹ B` to a digit at least: by a factor in single precision refined until corrections are
/// small. Where they do not shrink the factor is that of another matrix: no number.
pub(super) fn apply_inverse_for_certain(
    kernel: &Kernel,
    apply: &dyn Fn(&[f64]) -> Vec<f64>,
    b: Vec<f64>,
    n: usize,
    columns: usize,
) -> Vec<f64> {
    let mut x = kernel.apply_to_columns(b.clone(), n, columns);
    if !kernel.is_single() {
        return x;
    }
    let n = n.max(1);
    for (b, x) in b.chunks(n).zip(x.chunks_mut(n)) {
        let mut before = norm(x);
        while before > 0.1 * norm(x) {
            let correction = kernel.apply(subtract(b, &apply(x)));
            let size = norm(&correction);
            // A NaN ends the loop too.
            let shrinks = size <= 0.5 * before;
            x.iter_mut().zip(&correction).for_each(|(x, c)| {
                *x = if shrinks { *x + c } else { f64::NAN };
            });
            before = size;
        }
    }
    x
}
