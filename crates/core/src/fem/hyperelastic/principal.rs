//! Principal axes of symmetric matrices, and the tangents of isotropic laws in them: three stretches,
//! three flips, three twists.

use nalgebra::{Matrix3, SMatrix, Vector3};

/// Principal values and axes `A = Σ valueᵢ nᵢ nᵢᵀ`.
///
/// Shapes: value i belongs to column i of `axes`, in no order.
#[derive(Clone, Copy, Debug)]
pub(super) struct Principal {
    pub values: Vector3<f64>,
    pub axes: Matrix3<f64>,
}

/// Sweeps over the three entries off the diagonal; numbers converge within six, and what is no
/// number ends here.
const SWEEPS_MAX: usize = 12;
/// Size of what is off the diagonal, relative to the matrix, that is rounding.
const OFF_MAX: f64 = 1e-18;

impl Principal {
    /// Of a symmetric matrix, by rotations; the lower triangle is not read.
    ///
    /// Errors of the values are a few roundings of the largest. Values that are equal have any axes.
    ///
    /// Source: Jacobi (1846), as in Golub and Van Loan, "Matrix Computations", section 8.5.
    pub fn new(symmetric: &Matrix3<f64>) -> Self {
        let (mut a, mut axes) = (*symmetric, Matrix3::identity());
        for _ in 0..SWEEPS_MAX {
            let off = a[(0, 1)].abs().max(a[(0, 2)].abs()).max(a[(1, 2)].abs());
            let diagonal = a[(0, 0)].abs().max(a[(1, 1)].abs()).max(a[(2, 2)].abs());
            if off <= OFF_MAX * diagonal {
                break;
            }
            for (p, q, r) in [(0, 1, 2), (0, 2, 1), (1, 2, 0)] {
                rotate(&mut a, &mut axes, (p, q, r));
            }
        }
        Self { values: a.diagonal(), axes }
    }

    /// The matrix with the same axes and other values.
    pub fn with_values(&self, values: &Vector3<f64>) -> Matrix3<f64> {
        let scaled = Matrix3::from_fn(|r, c| self.axes[(r, c)] * values[c]);
        scaled * self.axes.transpose()
    }
}

/// Turns axes p < q so that the entry between them becomes zero; r is the third.
fn rotate(a: &mut Matrix3<f64>, axes: &mut Matrix3<f64>, (p, q, r): (usize, usize, usize)) {
    let between = a[(p, q)];
    if between == 0.0 {
        return;
    }
    let theta = 0.5 * (a[(q, q)] - a[(p, p)]) / between;
    let t = 1.0f64.copysign(theta) / (theta.abs() + theta.mul_add(theta, 1.0).sqrt());
    let c = 1.0 / t.mul_add(t, 1.0).sqrt();
    let s = t * c;
    a[(p, p)] -= t * between;
    a[(q, q)] += t * between;
    a[(p, q)] = 0.0;
    let upper = |i: usize, k: usize| (i.min(k), i.max(k));
    let (with_p, with_q) = (a[upper(p, r)], a[upper(q, r)]);
    a[upper(p, r)] = c * with_p - s * with_q;
    a[upper(q, r)] = s * with_p + c * with_q;
    for row in 0..3 {
        let (at_p, at_q) = (axes[(row, p)], axes[(row, q)]);
        axes[(row, p)] = c * at_p - s * at_q;
        axes[(row, q)] = s * at_p + c * at_q;
    }
}

/// Which tangent is asked for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Curvature {
    /// The second derivative of the energy, which may have negative eigenvalues.
    AsItIs,
    /// The sum of the positive parts of every element's: it has none.
    PositivePart,
}

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
    /// Stiffness of the flips `D_ik + D_ki`, by [`PAIRS`].
    pub flips: [f64; 3],
    /// Stiffness of the twists `D_ik − D_ki`, by [`PAIRS`].
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

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn symmetric(entries: [f64; 6]) -> Matrix3<f64> {
        let [a, b, c, d, e, f] = entries;
        Matrix3::new(a, d, e, d, b, f, e, f, c)
    }

    proptest! {
        #[test]
        fn values_and_axes_make_the_matrix_again(
            entries in prop::array::uniform6(-1.0..1.0f64), power in -200.0..200.0f64,
            flat in 0..4usize,
        ) {
            let mut entries = entries;
            // Equal values, zeros and axes that are principal already.
            entries.iter_mut().skip(2).take(flat).for_each(|x| *x = 0.0);
            let a = symmetric(entries) * 10f64.powf(power);
            let found = Principal::new(&a);
            let size = a.amax();
            prop_assert!((found.with_values(&found.values) - a).amax() <= 4e-15 * size);
            let product = found.axes.tr_mul(&found.axes);
            prop_assert!((product - Matrix3::identity()).amax() < 4e-15);
            prop_assert!((found.axes.determinant() - 1.0).abs() < 1e-14);
        }
    }

    #[test]
    fn what_is_no_number_ends() {
        let found = Principal::new(&Matrix3::from_element(f64::NAN));
        assert!(found.values.iter().all(|value| value.is_nan()));
        let zero = Principal::new(&Matrix3::zeros());
        assert_eq!(zero.values, Vector3::zeros());
    }
}
