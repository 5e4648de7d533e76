//! Refinement of direct answers, and solves that are good to a digit whatever the precision.

use super::{Factored, Kernel, subtract};
use crate::fem::Stiffness;
use crate::solve::pcg::norm;

/// Refinement stops after this many steps in any case.
const REFINEMENT_STEPS_MAX: u32 = 3;
/// The same with a single-precision factor, which gains four to seven digits a step.
const REFINEMENT_STEPS_SINGLE_MAX: u32 = 8;

/// How good an answer is.
pub(super) struct Judged {
    /// Componentwise backward error.
    pub backward_error: f64,
    /// How far it is from good, at most one if it is: by backward error and by residual.
    pub off: f64,
}

impl Factored {
    /// Improves `x` until it is judged good or gets no better; the number of steps, and what was
    /// found of the last `x`.
    pub(super) fn refine(
        &self,
        apply: &dyn Fn(&[f64]) -> Vec<f64>,
        judge: &mut dyn FnMut(&[f64], &[f64]) -> Judged,
        b: &[f64],
        x: &mut Vec<f64>,
        residual: &mut Vec<f64>,
    ) -> (u32, Judged) {
        let steps_max = match self.kernel {
            Kernel::FrontSingle(_) => REFINEMENT_STEPS_SINGLE_MAX,
            _ => REFINEMENT_STEPS_MAX,
        };
        let mut before = judge(x, residual);
        for step in 0..steps_max {
            if before.off <= 1.0 {
                return (step, before);
            }
            let correction = self.apply_inverse(residual.clone());
            let refined: Vec<f64> = x.iter().zip(&correction).map(|(x, c)| x + c).collect();
            let refined_residual = subtract(b, &apply(&refined));
            let after = judge(&refined, &refined_residual);
            // A NaN ends the loop too.
            if after.off >= before.off || after.off.is_nan() {
                return (step, before);
            }
            (*x, *residual, before) = (refined, refined_residual, after);
        }
        (steps_max, before)
    }

    /// `K11⁻¹ B` to a digit at least: by a factor in single precision refined until corrections are
    /// small. Where they do not shrink the factor is that of another matrix: no number.
    pub(in crate::solve) fn apply_inverse_for_certain(
        &self,
        stiffness: &Stiffness,
        b: Vec<f64>,
        columns: usize,
    ) -> Vec<f64> {
        let mut x = self.apply_inverse_to_columns(b.clone(), columns);
        if !matches!(self.kernel, Kernel::FrontSingle(_)) {
            return x;
        }
        let n = self.partition.unknown().len().max(1);
        for (b, x) in b.chunks(n).zip(x.chunks_mut(n)) {
            let mut before = norm(x);
            while before > 0.1 * norm(x) {
                let correction = self.apply_inverse(subtract(b, &self.apply_k11(stiffness, x)));
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
}
