//! The smallest eigenvalue of the held stiffness: estimated, and proven from below.
//!
//! A Cholesky factor of `K_B − s I` that exists proves that the smallest eigenvalue is at least s less
//! a margin (`docs/bound.md`, section 3).

use super::base::Base;
use super::rounding::{SLACK, UNIT, gamma};
use crate::solve::FrontFactor;
use crate::solve::vectors::norm;

/// Share of the estimated smallest eigenvalue that the shifted factor must prove.
const SHIFT_SHARE: f64 = 0.7;
/// Steps of inverse iteration: the estimate only has to be good to a few per cent.
const INVERSE_STEPS: usize = 12;

impl Base {
    /// Proves a lower bound of the smallest eigenvalue of the symmetric part of `K_B`, once; costs a
    /// second factor for the moment.
    ///
    /// Returns N/m, or `None` where double precision cannot prove one.
    pub fn prove_eigenvalue_min(&self) -> Option<f64> {
        self.eigenvalue_min.get_or(|| {
            let estimate = self.estimate_eigenvalue_min()?;
            let shift = SHIFT_SHARE * estimate;
            let shifted = self.stiffness.shifted(-shift);
            FrontFactor::<f64>::try_new(self.factor.analysis(), &shifted).ok()?;
            // Rump 2006 for any order of summation; twice, for divisions by way of reciprocals.
            let n = self.partition.unknown().len();
            let margin = 2.0 * gamma(n + 3) * self.stiffness.trace() * SLACK;
            // The shifted diagonal is rounded, and one triangle of K is read.
            let proven = shift - margin - UNIT * self.stiffest * SLACK - self.asymmetry;
            (proven > 0.0).then_some(proven * (1.0 - 1e-12))
        })
    }

    /// Bound proven earlier, without proving one now.
    pub fn eigenvalue_min(&self) -> Option<f64> {
        self.eigenvalue_min.get().flatten()
    }

    /// Rayleigh quotient after some steps of inverse iteration: an estimate from above.
    pub(super) fn estimate_eigenvalue_min(&self) -> Option<f64> {
        let n = self.partition.unknown().len();
        // A fixed start without symmetry.
        let mut x: Vec<f64> = (0..n).map(|i| 1.0 + 0.5 * (1.7 * i as f64).sin()).collect();
        let mut quotient = None;
        for _ in 0..INVERSE_STEPS {
            let size = norm(&x);
            if size.is_nan() || size <= 0.0 || !size.is_finite() {
                return None;
            }
            x.iter_mut().for_each(|v| *v /= size);
            let mut y = x.clone();
            self.factor.solve_in_place(&mut y, 1);
            let along: f64 = x.iter().zip(&y).map(|(a, b)| a * b).sum();
            quotient = (along > 0.0).then(|| 1.0 / along);
            x = y;
        }
        quotient
    }
}
