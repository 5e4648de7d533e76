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

/// Product `a x` of a block and W vectors.
#[inline(always)]
pub(super) fn times<const B: usize, const W: usize>(
    a: &[[f32; B]; B],
    x: &[[f32; W]; B],
) -> [[f32; W]; B] {
    let mut product = [[0.0; W]; B];
    for (sum, line) in product.iter_mut().zip(a) {
        for (a, x) in line.iter().zip(x) {
            (0..W).for_each(|w| sum[w] += a * x[w]);
        }
    }
    product
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
/// Sums that run beside each other. As many columns as divide it have sums of their own among them.
const LANES: usize = 8;

/// Scalar products `aᵀ b` of the W columns of long vectors.
///
/// Shapes: rows × W, the numbers of one row next to each other; W divides eight.
pub(super) fn dots<const W: usize>(a: &[f64], b: &[f64]) -> [f64; W] {
    let parts: Vec<[f64; W]> =
        a.par_chunks(PART).zip(b.par_chunks(PART)).map(|(a, b)| of_part(a, b)).collect();
    let mut sums = [0.0; W];
    for part in parts {
        (0..W).for_each(|w| sums[w] += part[w]);
    }
    sums
}

fn of_part<const W: usize>(a: &[f64], b: &[f64]) -> [f64; W] {
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
    std::array::from_fn(|w| sums.iter().skip(w).step_by(W).sum())
}

/// Euclidean norms of the W columns of a long vector.
///
/// Shapes: as [`dots`].
pub(super) fn norms<const W: usize>(v: &[f64]) -> [f64; W] {
    let squares = dots::<W>(v, v);
    std::array::from_fn(|w| match squares[w] {
        square if SAFE_SQUARES.contains(&square) => square.sqrt(),
        _ => vectors::norm(&v.iter().skip(w).step_by(W).copied().collect::<Vec<f64>>()),
    })
}

/// Largest absolute values of the W columns; a NaN is passed over.
///
/// Shapes: as [`dots`].
pub(super) fn largest<const W: usize>(v: &[f64]) -> [f64; W] {
    let of_part = |part: &[f64]| {
        let mut most = [0.0f64; W];
        for row in part.as_chunks::<W>().0 {
            (0..W).for_each(|w| most[w] = most[w].max(row[w].abs()));
        }
        most
    };
    let larger = |a: [f64; W], b: [f64; W]| std::array::from_fn(|w| a[w].max(b[w]));
    v.par_chunks(PART).map(of_part).reduce(|| [0.0; W], larger)
}

/// `aᵀ b` of vectors of blocks, in double precision.
pub(super) fn dot_blocks<const B: usize>(a: &[[[f32; 1]; B]], b: &[[[f32; 1]; B]]) -> f64 {
    let parts: Vec<f64> = a
        .par_chunks(PART)
        .zip(b.par_chunks(PART))
        .map(|(a, b)| {
            let products = a.as_flattened().iter().zip(b.as_flattened());
            products.map(|([a], [b])| f64::from(*a) * f64::from(*b)).sum()
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

    #[test]
    fn columns_have_the_sums_that_each_has_alone() {
        let rows = 3 * PART + 5;
        let of = |seed: f64| move |k: usize| (seed * (k + 1) as f64).sin();
        let a: Vec<f64> = (0..4 * rows).map(of(0.37)).collect();
        let b: Vec<f64> = (0..4 * rows).map(of(0.71)).collect();
        let column = |v: &[f64], w: usize| v.iter().skip(w).step_by(4).copied().collect::<Vec<_>>();
        let (together, most, sizes) = (dots::<4>(&a, &b), largest::<4>(&a), norms::<4>(&a));
        for w in 0..4 {
            let (a, b) = (column(&a, w), column(&b, w));
            let [alone] = dots::<1>(&a, &b);
            assert!((together[w] - alone).abs() < 1e-10, "{} is not {alone}", together[w]);
            assert_eq!([most[w]], largest::<1>(&a));
            assert!((sizes[w] - norms::<1>(&a)[0]).abs() < 1e-10);
        }
    }
}
