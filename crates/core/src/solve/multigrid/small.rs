//! Products and inverses of blocks, whose sizes are known when the program is compiled.

/// `sum + a b`.
#[inline(always)]
pub(super) fn add_product<const R: usize, const K: usize, const C: usize>(
    sum: &mut [[f64; C]; R],
    a: &[[f64; K]; R],
    b: &[[f64; C]; K],
) {
    for (sum, a) in sum.iter_mut().zip(a) {
        for (a, b) in a.iter().zip(b) {
            for (sum, b) in sum.iter_mut().zip(b) {
                *sum += a * b;
            }
        }
    }
}

/// `sum + aᵀ b`.
#[inline(always)]
pub(super) fn add_transposed_product<const R: usize, const K: usize, const C: usize>(
    sum: &mut [[f64; C]; R],
    a: &[[f64; R]; K],
    b: &[[f64; C]; K],
) {
    for (a, b) in a.iter().zip(b) {
        for (sum, a) in sum.iter_mut().zip(a) {
            for (sum, b) in sum.iter_mut().zip(b) {
                *sum += a * b;
            }
        }
    }
}

/// `a x`.
#[inline(always)]
pub(super) fn times<const B: usize>(a: &[[f32; B]; B], x: &[f32; B]) -> [f32; B] {
    a.map(|line| line.iter().zip(x).map(|(a, x)| a * x).sum())
}

/// The block in double precision.
#[inline(always)]
pub(super) fn exact<const R: usize, const C: usize>(a: &[[f32; C]; R]) -> [[f64; C]; R] {
    a.map(|line| line.map(f64::from))
}

/// A pivot this small beside its diagonal entry is lost in the rounding of the block's entries.
const PIVOT_LOST: f64 = 1e-6;

/// Inverse of a symmetric positive definite block; that of its diagonal where the block is none in
/// single precision.
pub(super) fn inverse<const B: usize>(a: &[[f64; B]; B]) -> [[f64; B]; B] {
    let mut left = *a;
    let mut inverse = [[0.0; B]; B];
    (0..B).for_each(|k| inverse[k][k] = 1.0);
    for k in 0..B {
        let pivot = left[k][k];
        if pivot.is_nan() || pivot <= PIVOT_LOST * a[k][k] {
            return inverse_of_diagonal(a);
        }
        for c in 0..B {
            left[k][c] /= pivot;
            inverse[k][c] /= pivot;
        }
        for r in (0..B).filter(|r| *r != k) {
            let factor = left[r][k];
            for c in 0..B {
                left[r][c] -= factor * left[k][c];
                inverse[r][c] -= factor * inverse[k][c];
            }
        }
    }
    // Symmetric to the last bit, so that what is made of it is a norm.
    let transposed = inverse;
    for r in 0..B {
        for c in 0..B {
            inverse[r][c] = 0.5 * (inverse[r][c] + transposed[c][r]);
        }
    }
    inverse
}

fn inverse_of_diagonal<const B: usize>(a: &[[f64; B]; B]) -> [[f64; B]; B] {
    let mut inverse = [[0.0; B]; B];
    for k in 0..B {
        // Nothing moves where there is no stiffness.
        inverse[k][k] = if a[k][k] > 0.0 { 1.0 / a[k][k] } else { 0.0 };
    }
    inverse
}

/// Sum of the squares of the entries.
pub(super) fn square<const R: usize, const C: usize>(a: &[[f64; C]; R]) -> f64 {
    a.iter().flatten().map(|x| x * x).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn inverse_times_block_is_the_identity() {
        let a = [[4.0, 1.0, -0.5], [1.0, 3.0, 0.25], [-0.5, 0.25, 2.0]];
        let mut product = [[0.0; 3]; 3];
        add_product(&mut product, &inverse(&a), &a);
        for (r, line) in product.iter().enumerate() {
            for (c, x) in line.iter().enumerate() {
                assert!((x - f64::from(u8::from(r == c))).abs() < 1e-14);
            }
        }
    }

    #[test]
    fn block_that_is_not_definite_falls_back_to_its_diagonal() {
        let inverse = inverse(&[[1.0, 2.0], [2.0, 4.0]]);
        assert_eq!(inverse, [[1.0, 0.0], [0.0, 0.25]]);
    }
}
