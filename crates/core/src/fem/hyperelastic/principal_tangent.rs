//! The tangent of an isotropic law in principal axes: three stretches, three flips, three twists.

use nalgebra::{Matrix3, SMatrix, Vector3};

use super::principal::Principal;

/// A tangent as a matrix over the nine entries of `dF`, column by column (`3 c + r`).
pub(super) type Tangent9 = SMatrix<f64, 9, 9>;

/// The two axes of each flip and each twist.
pub(super) const PAIRS: [(usize, usize); 3] = [(0, 1), (1, 2), (0, 2)];

/// The tangent `dP = L Y Rᵀ` of an isotropic law with `D = Lᵀ dF R`: on the diagonal
/// `Yᵢᵢ = Σ_k stretches_ik D_kk`, off it `(D_ik ± D_ki)/2` times flip and twist of the pair.
///
/// Shapes: columns of `left` and `right` the principal axes behind and before the deformation.
/// Units: Pa.
///
/// Source: eigenvalues of isotropic tangents as in Smith, de Goes and Kim, "Analytic eigensystems
/// for isotropic distortion energies" (2019).
#[derive(Clone, Copy, Debug)]
pub(super) struct PrincipalTangent {
    pub left: Matrix3<f64>,
    pub right: Matrix3<f64>,
    /// Second derivatives of the energy by the stretches.
    pub stretches: Matrix3<f64>,
    /// Of `D_ik + D_ki`, by [`PAIRS`].
    pub flips: [f64; 3],
    /// Of `D_ik − D_ki`, by [`PAIRS`].
    pub twists: [f64; 3],
}

impl PrincipalTangent {
    /// `dP` of a change `dF`.
    ///
    /// Shapes: 3 × 3. Units: Pa.
    pub fn apply(&self, df: &Matrix3<f64>) -> Matrix3<f64> {
        let d = self.left.tr_mul(df) * self.right;
        let mut y = Matrix3::from_diagonal(&(self.stretches * d.diagonal()));
        for (n, (i, k)) in PAIRS.into_iter().enumerate() {
            let flipped = 0.5 * self.flips[n] * (d[(i, k)] + d[(k, i)]);
            let twisted = 0.5 * self.twists[n] * (d[(i, k)] - d[(k, i)]);
            y[(i, k)] = flipped + twisted;
            y[(k, i)] = flipped - twisted;
        }
        self.left * y * self.right.transpose()
    }

    /// Its positive part while the axes are at right angles: eigenvalues below zero become zero.
    pub fn positive_part(self) -> Self {
        let principal = Principal::new(&self.stretches);
        let positive = |value: f64| value.max(0.0);
        Self {
            stretches: principal.with_values(&principal.values.map(positive)),
            flips: self.flips.map(positive),
            twists: self.twists.map(positive),
            ..self
        }
    }

    /// Material tangent `dP/dF` as a 9 × 9 matrix over `dF` column by column.
    pub fn matrix(&self) -> Tangent9 {
        let mut matrix = Tangent9::zeros();
        for column in 0..9 {
            let mut df = Matrix3::zeros();
            df[column] = 1.0;
            matrix.column_mut(column).copy_from_slice(self.apply(&df).as_slice());
        }
        matrix
    }
}

/// What a law says at principal logarithmic strains, for [`PrincipalTangent`].
///
/// Shapes: `squares` are the squared stretches; `stress` the Kirchhoff stresses τ; `slopes` ∂τᵢ/∂e_k;
/// `secant` is c in `τᵢ − τ_k = c (eᵢ − e_k)`. Units: Pa.
pub(super) struct OfStrains {
    pub strains: Vector3<f64>,
    pub squares: Vector3<f64>,
    pub stress: Vector3<f64>,
    pub slopes: Matrix3<f64>,
    pub secant: f64,
}

impl OfStrains {
    /// The tangent with these axes. Equal stretches are no special case: with `y = (eᵢ − e_k)/2`
    /// and the mean τ̄ of two stresses `(pᵢ − p_k)/(sᵢ − s_k) = (c y coth y − τ̄)/(sᵢ s_k)` and
    /// `(pᵢ + p_k)/(sᵢ + s_k) = (τ̄ − c y tanh y)/(sᵢ s_k)` for `p = τ/s`.
    ///
    /// Source: derived here; compared with differences in the tests.
    pub fn tangent(&self, left: Matrix3<f64>, right: Matrix3<f64>) -> PrincipalTangent {
        let s = self.squares.map(f64::sqrt);
        let stretches = Matrix3::from_fn(|i, k| {
            let own = if i == k { self.stress[i] } else { 0.0 };
            (self.slopes[(i, k)] - own) / (s[i] * s[k])
        });
        let of_pair = |(i, k): (usize, usize)| {
            let y = 0.5 * (self.strains[i] - self.strains[k]);
            let mean = 0.5 * (self.stress[i] + self.stress[k]);
            let coth = if y == 0.0 { 1.0 } else { y / y.tanh() };
            let flip = self.secant * coth - mean;
            let twist = mean - self.secant * y * y.tanh();
            (flip / (s[i] * s[k]), twist / (s[i] * s[k]))
        };
        PrincipalTangent {
            left,
            right,
            stretches,
            flips: PAIRS.map(|pair| of_pair(pair).0),
            twists: PAIRS.map(|pair| of_pair(pair).1),
        }
    }
}
