//! How many digits of a direct answer are certain, estimated from its residual and from how much a
//! small force can move the body.
//!
//! With ω the componentwise backward error of an answer (the smallest relative change of `K` and of
//! the loads for which it would be exact, Oettli and Prager 1964), its error is at most about
//! `ω ‖ |K11⁻¹| |K| e ‖ ‖q‖` in the largest component, e a vector of ones. The factor in front of
//! ‖q‖ is Skeel's condition number with the known displacements counted in. Unlike the usual
//! condition number it does not grow when rows are scaled, so a hard inclusion in a soft body, or a
//! sliver, is not blamed for what does no harm.
//!
//! Source: Higham, Accuracy and Stability of Numerical Algorithms (2002), 7.2 and 15; estimator of
//! Hager (1984) and Higham (1988) in the form with two columns of Higham and Tisseur (2000).

use super::partition::Partition;
use crate::fem::Stiffness;

/// How certain the digits of an answer are.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Certainty {
    /// Estimate of `‖ |K11⁻¹| |K| e ‖`, from below and seldom by more than a factor of three.
    pub condition: f64,
    /// Estimate of the largest error over the largest displacement.
    pub error_rel: f64,
}

/// Error up to which nothing needs to be said: nine digits are more than any object is known to.
pub const ERROR_UNREMARKABLE: f64 = 1e-9;
/// Error from which few digits are left.
pub const ERROR_SERIOUS: f64 = 1e-3;
/// Error from which there is no answer.
pub const ERROR_REFUSED: f64 = 0.1;

impl Certainty {
    /// From a condition number and the backward error of an answer.
    pub fn new(condition: f64, backward_error: f64) -> Self {
        // What is computed cannot be told from rounding below this.
        let backward_error = backward_error.max(f64::EPSILON);
        Self { condition, error_rel: condition * backward_error }
    }

    /// Whether no digit is certain.
    pub fn is_none(&self) -> bool {
        self.error_rel.is_nan() || self.error_rel >= ERROR_REFUSED
    }
}

/// Steps of the estimator; it seldom gains anything after the second.
const STEPS_MAX: usize = 2;

/// Estimate of `‖ |A⁻¹| w ‖∞ = ‖ W A⁻¹ ‖₁` of a symmetric matrix from solves with it.
///
/// Shapes: `w` n weights, not negative; `solve` takes and gives columns of n, one behind the other.
///
/// Source: Higham and Tisseur 2000, algorithm 2.4 with two columns.
pub(super) fn inverse_norm(w: &[f64], solve: &dyn Fn(Vec<f64>, usize) -> Vec<f64>) -> f64 {
    let n = w.len();
    if n == 0 {
        return 0.0;
    }
    let even = |_: usize| 1.0 / n as f64;
    // Without pattern, so that no mesh is orthogonal to it.
    let mixed = |i: usize| (7.3 * (i + 1) as f64).sin().signum() / n as f64;
    let mut x: Vec<f64> = (0..n).map(even).chain((0..n).map(mixed)).collect();
    let weigh = |columns: &mut [f64]| {
        columns.chunks_mut(n).for_each(|c| c.iter_mut().zip(w).for_each(|(c, w)| *c *= w));
    };
    let mut estimate = 0.0f64;
    for step in 1.. {
        let mut y = solve(x, 2);
        weigh(&mut y);
        let norms = y.chunks(n).map(|c| c.iter().map(|y| y.abs()).sum::<f64>());
        let found = norms.fold(0.0, |most: f64, norm| match most.is_nan() || norm <= most {
            true => most,
            // A NaN comes here, and stays.
            false => norm,
        });
        if found.is_nan() {
            return f64::INFINITY;
        }
        let gained = found > estimate;
        estimate = estimate.max(found);
        if !gained || step == STEPS_MAX {
            break;
        }
        y.iter_mut().for_each(|y| *y = if *y < 0.0 { -1.0 } else { 1.0 });
        weigh(&mut y);
        let z = solve(y, 2);
        let size = |i: &usize| z[*i].abs().max(z[n + *i].abs());
        let largest = |but: Option<usize>| {
            (0..n).filter(|i| Some(*i) != but).max_by(|a, b| size(a).total_cmp(&size(b)))
        };
        let first = largest(None);
        x = vec![0.0; 2 * n];
        if let Some(i) = first {
            x[i] = 1.0;
        }
        if let Some(i) = largest(first) {
            x[n + i] = 1.0;
        }
    }
    estimate
}

/// `|K| e` on the rows of `K11`.
pub(super) fn row_sums(stiffness: &Stiffness, partition: &Partition) -> Vec<f64> {
    let sums = stiffness.mul_abs(&vec![1.0; partition.dof_count()]);
    partition.unknown().iter().map(|&dof| sums[dof as usize]).collect()
}

/// Componentwise backward error of `K q = f` on the free rows.
///
/// Shapes: `q` 3N; `residual` n; `forces` empty or 3N.
///
/// Source: Oettli and Prager 1964.
pub(super) fn backward_error(
    stiffness: &Stiffness,
    partition: &Partition,
    q: &[f64],
    residual: &[f64],
    forces: &[f64],
) -> f64 {
    let sizes = stiffness.mul_abs(q);
    let rows = partition.unknown().iter().map(|&dof| dof as usize).zip(residual);
    rows.map(|(dof, r)| {
        let size = sizes[dof] + forces.get(dof).map_or(0.0, |f| f.abs());
        // Where nothing acts nothing can be wrong, unless it is.
        if *r == 0.0 { 0.0 } else { r.abs() / size }
    })
    .fold(0.0, |most, ratio| if ratio > most || ratio.is_nan() { ratio } else { most })
}

#[cfg(test)]
mod tests {
    use nalgebra::{DMatrix, DVector};
    use proptest::prelude::*;

    use super::*;

    proptest! {
        /// The estimate is a lower bound by construction, and near the truth.
        #[test]
        fn estimate_is_below_the_norm_and_not_far(
            entries in prop::collection::vec(-1.0..1.0f64, 20 * 20),
            spread in 0.0..6.0f64,
            w in prop::collection::vec(0.1..3.0f64, 20),
        ) {
            let n = 20;
            let b = DMatrix::from_vec(n, n, entries);
            let scale = DMatrix::from_diagonal(&DVector::from_fn(n, |i, _| {
                10f64.powf(spread * i as f64 / n as f64)
            }));
            let a = &scale * (&b * b.transpose() + DMatrix::identity(n, n) * 0.1) * &scale;
            let inverse = a.clone().try_inverse().unwrap();
            let truth = (0..n)
                .map(|i| (0..n).map(|j| inverse[(i, j)].abs() * w[j]).sum::<f64>())
                .fold(0.0, f64::max);
            let lu = a.lu();
            let solve = |b: Vec<f64>, columns: usize| {
                let b = DMatrix::from_vec(n, columns, b);
                lu.solve(&b).unwrap().as_slice().to_vec()
            };
            let estimate = inverse_norm(&w, &solve);
            prop_assert!(estimate <= truth * (1.0 + 1e-6), "{estimate} above {truth}");
            prop_assert!(estimate >= truth / 3.0, "{estimate} far below {truth}");
        }
    }

    #[test]
    fn solves_that_give_no_number_leave_nothing_certain() {
        let solve = |b: Vec<f64>, columns: usize| {
            let n = b.len() / columns;
            b.iter().enumerate().map(|(i, b)| if i < n { f64::NAN } else { *b }).collect()
        };
        assert_eq!(inverse_norm(&[1.0; 5], &solve), f64::INFINITY);
    }

    #[test]
    fn rows_scaled_by_powers_of_ten_keep_their_condition() {
        // Skeel's number of a diagonal matrix is one, whatever is on the diagonal.
        let diagonal: Vec<f64> = (0..9).map(|i| 10f64.powi(2 * i - 9)).collect();
        let solve = |b: Vec<f64>, _: usize| {
            b.iter().zip(diagonal.iter().cycle()).map(|(b, d)| b / d).collect::<Vec<f64>>()
        };
        assert!((inverse_norm(&diagonal, &solve) - 1.0).abs() < 1e-12);
        assert!(Certainty::new(1e16, 0.0).is_none() && Certainty::new(f64::NAN, 0.0).is_none());
        assert!(!Certainty::new(1e3, 1e-16).is_none());
    }
}
