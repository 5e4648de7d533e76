//! Principal values and axes of a symmetric 3 × 3 matrix.

use nalgebra::{Matrix3, Vector3};

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
