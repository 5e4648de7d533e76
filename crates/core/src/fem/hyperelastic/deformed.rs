//! The deformation gradient at one point, and what every law makes of it.

use nalgebra::Matrix3;

/// Deformation gradient `F = I + H` of a point, its volume ratio and its inverse transposed.
///
/// Shapes: 3 × 3. Units: 1.
#[derive(Clone, Copy, Debug)]
pub struct Deformed {
    /// Deformation gradient `F`.
    pub f: Matrix3<f64>,
    /// `F⁻ᵀ`, or no numbers where the volume is gone.
    pub f_inverse_transposed: Matrix3<f64>,
    /// `J = det F`.
    pub j: f64,
    /// `J − 1`, without the cancellation that the difference would have at small strain.
    pub j_minus_one: f64,
    /// Green's strain `E = ½ (H + Hᵀ + Hᵀ H)`: as exact at small strain as at large.
    pub green: Matrix3<f64>,
}

impl Deformed {
    /// From the displacement gradient `H = Σ u_a ∇N_aᵀ`.
    ///
    /// Shapes: 3 × 3. Units: 1.
    ///
    /// Source: thesis (3.28) for `H`.
    #[inline]
    pub fn new(h: &Matrix3<f64>) -> Self {
        let f = h + Matrix3::identity();
        let cofactor = cofactor(&f);
        let trace = h.trace();
        // det(I + H) − 1 by the invariants of H.
        let second = 0.5 * (trace * trace - (h * h).trace());
        let j_minus_one = trace + second + h.determinant();
        let j = 1.0 + j_minus_one;
        let green = (h + h.transpose() + h.tr_mul(h)) * 0.5;
        Self { f, f_inverse_transposed: cofactor / j, j, j_minus_one, green }
    }
}

/// Cofactor matrix, `det(F) F⁻ᵀ`.
#[inline]
pub(super) fn cofactor(f: &Matrix3<f64>) -> Matrix3<f64> {
    let (c1, c2, c3) = (f.column(0), f.column(1), f.column(2));
    Matrix3::from_columns(&[c2.cross(&c3), c3.cross(&c1), c1.cross(&c2)])
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn inverse_and_volume_are_those_of_the_gradient(
            h in prop::array::uniform9(-0.4..0.4f64), scale in 1e-9..1.0f64,
        ) {
            let h = Matrix3::from_row_slice(&h) * scale;
            let point = Deformed::new(&h);
            prop_assume!(point.j > 0.05);
            let product = point.f_inverse_transposed.tr_mul(&point.f);
            prop_assert!((product - Matrix3::identity()).amax() < 1e-12);
            prop_assert!((point.j - point.f.determinant()).abs() < 1e-14);
            let green = (point.f.tr_mul(&point.f) - Matrix3::identity()) * 0.5;
            prop_assert!((green - point.green).amax() < 1e-15);
        }
    }

    #[test]
    fn tiny_volume_changes_keep_their_digits() {
        let h = Matrix3::from_diagonal_element(1e-12);
        assert!((Deformed::new(&h).j_minus_one / 3e-12 - 1.0).abs() < 1e-11);
    }
}
