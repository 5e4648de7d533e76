//! Rate of a matrix product: the largest rate of a processor in practice.

use std::time::Instant;

use faer::linalg::matmul::matmul;
use faer::{Accum, Mat, Par};

/// Side of the square matrices: so large that the start does not count, and within a level-3 cache.
const SIDE: usize = 1500;

/// Number of products, of which the fastest counts, after one that touches the memory.
const PRODUCTS: usize = 5;

/// Largest rate of faer's product of square matrices on `threads` threads.
///
/// Units: GFlop/s.
pub fn product_rate<T: faer::traits::RealField + From<f32>>(threads: usize) -> f64 {
    let entry = |i: usize, j: usize| T::from(((i * 7 + j * 3) % 11) as f32 - 5.0);
    let (a, b) = (Mat::<T>::from_fn(SIDE, SIDE, entry), Mat::<T>::from_fn(SIDE, SIDE, entry));
    let mut c = Mat::<T>::zeros(SIDE, SIDE);
    let par = if threads == 1 { Par::Seq } else { Par::rayon(threads) };
    let mut product = || {
        let start = Instant::now();
        matmul(c.as_mut(), Accum::Replace, a.as_ref(), b.as_ref(), T::from(1.0), par);
        start.elapsed().as_secs_f64()
    };
    product();
    let elapsed = (0..PRODUCTS).map(|_| product()).fold(f64::INFINITY, f64::min);
    // A product that nobody looks at need not be made.
    std::hint::black_box(&c);
    2.0 * (SIDE as f64).powi(3) / elapsed / 1e9
}
