//! The motions without energy as one nearly orthonormal basis, and how much energy rounding gives
//! them (`docs/bound.md`, section 2).

use nalgebra::DMatrix;

use super::rounding::{Ball, SLACK, gamma, rounding_of_product, settled};
use crate::fem::Stiffness;
use crate::solve::vectors::norm;

/// A motion that costs no energy and leaves the fixed degrees of freedom in place.
pub(super) struct Mode {
    /// Displacement of every degree of freedom, largest about one.
    pub field: Vec<f64>,
    /// Norm of the field.
    pub norm: f64,
    /// Norm of `K` times the field, as computed; it is all rounding.
    pub residual: f64,
    /// Bound on the same norm, rounding of the computation included.
    pub residual_bound: f64,
}

impl Mode {
    /// Shapes: `field` 3N.
    pub fn new(stiffness: &Stiffness, field: Vec<f64>) -> Self {
        let residual = norm(&stiffness.mul(&field));
        let residual_bound = settled(residual, rounding_of_product(stiffness, &field));
        Self { norm: norm(&field), residual, residual_bound, field }
    }
}

/// `R D`: the modes, combined to a nearly orthonormal basis.
///
/// Shapes: z modes; both matrices z².
pub(super) struct Rigid {
    /// D.
    pub to_orthonormal: DMatrix<f64>,
    /// About its inverse.
    pub from_modes: DMatrix<f64>,
    /// Bound of `‖R D‖`.
    pub norm: f64,
    /// Bound of `‖K R D‖`, `‖Kᵀ R D‖` and that of the symmetric part, N/m.
    pub stiffness: f64,
}

impl Rigid {
    /// `None` where there is no mode, or where it is not proven that the rows `held` determine the
    /// modes.
    ///
    /// Units: `asymmetry` N/m.
    pub fn new(modes: &[Mode], held: &[u32], asymmetry: f64) -> Option<Self> {
        let z = modes.len();
        let first = modes.first()?;
        let product = |i: usize, j: usize| {
            let (a, b) = (&modes[i].field, &modes[j].field);
            a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>()
        };
        let sums = gamma(first.field.len() + 2);
        let gram = Ball {
            middle: DMatrix::from_fn(z, z, |i, j| product(i.min(j), i.max(j))),
            radius: DMatrix::from_fn(z, z, |i, j| modes[i].norm * modes[j].norm * sums * SLACK),
        };
        let lower = gram.middle.clone().cholesky()?.l();
        let to_orthonormal = lower.clone().try_inverse()?.transpose();
        let exact = Ball::exact(to_orthonormal.clone());
        let departure = exact.transposed().times(&gram).times(&exact).distance_from_identity();
        let rows = DMatrix::from_fn(z, z, |i, j| {
            held.get(i).map_or(0.0, |&dof| modes[j].field[dof as usize])
        });
        let rows = Ball::exact(rows).times(&exact);
        let inverse = Ball::exact(rows.middle.clone().try_inverse()?);
        // Written so that a NaN is refused too.
        let is_proven = departure < 1.0 && inverse.times(&rows).distance_from_identity() < 1.0;
        let column = |j: usize| {
            let bound = |i: usize| modes[i].residual_bound + 2.0 * asymmetry * modes[i].norm;
            (0..z).map(|i| bound(i) * to_orthonormal[(i, j)].abs()).sum::<f64>()
        };
        let stiffness = (0..z).map(|j| column(j).powi(2)).sum::<f64>().sqrt() * SLACK;
        is_proven.then(|| Self {
            norm: (1.0 + departure).sqrt() * SLACK,
            from_modes: lower.transpose(),
            to_orthonormal,
            stiffness,
        })
    }
}
