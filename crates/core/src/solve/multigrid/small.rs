//! Products and inverses of blocks, whose sizes are known when the program is compiled; and sums over long
//! vectors in parts of a fixed length, whose sums are added in their order, so that any number of threads
//! gives the same bits.

use rayon::prelude::*;

use crate::solve::vectors::{self, SAFE_SQUARES};

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

/// Product `a x` of a block and a vector.
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

/// Numbers of a part.
pub(super) const PART: usize = 4096;
/// Sums that run beside each other.
const LANES: usize = 8;

/// Scalar product `aᵀ b` of long vectors.
pub(super) fn dot(a: &[f64], b: &[f64]) -> f64 {
    let parts: Vec<f64> =
        a.par_chunks(PART).zip(b.par_chunks(PART)).map(|(a, b)| of_part(a, b)).collect();
    parts.iter().sum()
}

fn of_part(a: &[f64], b: &[f64]) -> f64 {
    let mut sums = [0.0; LANES];
    let ((a, a_rest), (b, b_rest)) = (a.as_chunks::<LANES>(), b.as_chunks::<LANES>());
    for (sum, (a, b)) in sums.iter_mut().zip(a_rest.iter().zip(b_rest)) {
        *sum = a * b;
    }
    for (a, b) in a.iter().zip(b) {
        for k in 0..LANES {
            sums[k] += a[k] * b[k];
        }
    }
    sums.iter().sum()
}

/// Euclidean norm of a long vector.
pub(super) fn norm(v: &[f64]) -> f64 {
    match dot(v, v) {
        square if SAFE_SQUARES.contains(&square) => square.sqrt(),
        _ => vectors::norm(v),
    }
}

/// Largest absolute value; a NaN is passed over.
pub(super) fn largest(v: &[f64]) -> f64 {
    v.par_chunks(PART).map(vectors::largest).reduce(|| 0.0, f64::max)
}

/// `aᵀ b` of vectors of blocks, in double precision.
pub(super) fn dot_blocks<const B: usize>(a: &[[f32; B]], b: &[[f32; B]]) -> f64 {
    let parts: Vec<f64> = a
        .par_chunks(PART)
        .zip(b.par_chunks(PART))
        .map(|(a, b)| {
            let products = a.iter().flatten().zip(b.iter().flatten());
            products.map(|(a, b)| f64::from(*a) * f64::from(*b)).sum()
        })
        .collect();
    parts.iter().sum()
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
