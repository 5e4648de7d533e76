//! Sums over long vectors in parts of a fixed length, whose sums are added in their order, so that
//! any number of threads gives the same bits.

use rayon::prelude::*;

use crate::solve::vectors::{self, SAFE_SQUARES};

/// Numbers of a part.
pub(super) const PART: usize = 4096;
/// Sums that run beside each other.
const LANES: usize = 8;

/// `aᵀ b`.
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

/// Euclidean norm.
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
