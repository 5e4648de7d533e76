//! A proven bound on the error of every answer, from numbers worked out once per contact set.
//!
//! What is held are means `Eᵀu = q`; a touched degree of freedom is a column of E with a single one.
//! With `Eᵀu = q` in place, the error e of an answer with residual r lies in the space V of fields
//! with `Eᵀv = 0`, and `vᵀK e = vᵀr` for all v in V; so `‖e‖ ≤ ‖K_V⁻¹‖ ‖r‖`, with K_V the
//! stiffness on V. Two facts make this cheap:
//!
//! * `r` is a combination of the columns' residuals, bounded by the triangle inequality.
//! * If the scene's own fixed nodes are the base, V is a part of the space of `K_B`, and a form is
//!   nowhere smaller on a part than on the whole: `λ_min(K_V) ≥ λ_min(K_B)` (for single nodes this
//!   is Cauchy's interlacing). If the base is artificial, any load f moves the touched body by
//!   `u = K_B⁻¹ f + M y` with `S y = −Mᵀ f`, where `M = [G R]`, `G = K_B⁻¹ E`, and S is the small
//!   matrix: `Eᵀu` is then zero, and the contacts' forces balance f. Only `G = K_B⁻¹ E` is used, so
//!   it holds for every E; hence `‖K_V⁻¹‖ ≤ 1/λ_min(K_B) + ‖M D‖² ‖(D S D)⁻¹‖` for any diagonal D.
//!
//! If the means are off by d, the smallest field that has them is `E (EᵀE)⁻¹ d`; it is added to the
//! error, and its forces to the residual. The forces of the contacts that do not balance are a load
//! on the base, as large as their imbalance.
//!
//! `λ_min(K_B)` is bounded from below by a Cholesky factor of `K_B − s I`: if it exists, the
//! smallest eigenvalue is at least s less a rounding margin.

use std::sync::Arc;

use nalgebra::DMatrix;

use super::base::{Base, CondensedError, gamma};
use super::columns::ContactColumns;
use crate::solve::FrontFactor;
use crate::solve::vectors::norm;

/// What the bound needs of a contact set.
pub(super) struct SmallBound {
    /// `‖M D‖² ‖(D S D)⁻¹‖`; zero when the scene's own nodes are the base.
    pub compliance: f64,
}

impl SmallBound {
    /// Shapes: `inverse` of the scaled small matrix, (c + z)².
    pub fn new(
        base: &Base,
        columns: &[Arc<ContactColumns>],
        places: &[(usize, usize)],
        inverse: &DMatrix<f64>,
        scale: f64,
    ) -> Result<Self, CondensedError> {
        if !inverse.iter().all(|x| x.is_finite()) {
            return Err(CondensedError::NotHeld);
        }
        if base.is_held_by_scene() {
            return Ok(Self { compliance: 0.0 });
        }
        let column_norms = places.iter().map(|&(at, axis)| columns[at].norms[axis]);
        let norms: Vec<f64> = column_norms.chain(base.modes.iter().map(|m| m.norm)).collect();
        // D makes every column of M a unit vector; a zero column (a held node) keeps its place.
        let largest = norms.iter().copied().fold(0.0, f64::max);
        let d = |i: usize| 1.0 / norms[i].max(1e-6 * largest);
        // The scaled system is diag(scale, 1) applied to the columns of λ and to q, so the true
        // inverse is recovered by the same factors.
        let c = places.len();
        let unscale = |i: usize, j: usize| match (i < c, j < c) {
            (true, true) => scale,
            (false, false) => 1.0 / scale,
            _ => 1.0,
        };
        let mut frobenius = 0.0f64;
        for i in 0..norms.len() {
            for j in 0..norms.len() {
                frobenius = frobenius.hypot(inverse[(i, j)] * unscale(i, j) / (d(i) * d(j)));
            }
        }
        let columns: f64 = (0..norms.len()).map(|i| (norms[i] * d(i)).powi(2)).sum();
        Ok(Self { compliance: columns * frobenius })
    }
}

/// Share of the estimated smallest eigenvalue that the shifted factor must prove.
const SHIFT_SHARE: f64 = 0.7;
/// Steps of inverse iteration: the estimate only has to be good to a few per cent.
const INVERSE_STEPS: usize = 12;

impl Base {
    /// Proves a lower bound of `λ_min(K_B)`, once; costs a second factor for the moment.
    ///
    /// Returns N/m, or `None` where double precision cannot prove one.
    pub fn prove_eigenvalue_min(&self) -> Option<f64> {
        self.eigenvalue_min.get_or(|| {
            let estimate = self.estimate_eigenvalue_min()?;
            let shift = SHIFT_SHARE * estimate;
            let shifted = self.stiffness.shifted(-shift);
            FrontFactor::<f64>::try_new(self.factor.analysis(), &shifted).ok()?;
            // Rump 2006: a Cholesky factor that exists proves the matrix it belongs to, which is
            // within γ_{n+1} tr of the given one; n is at most the number of rows.
            let n = self.partition.unknown().len();
            let margin = gamma(n + 2) * self.stiffness.trace() * 2.0;
            let proven = shift - margin;
            (proven > 0.0).then_some(proven)
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
