//! The rate of a matrix product: what a processor can do at most.

use std::time::Instant;

use faer::linalg::matmul::matmul;
use faer::{Accum, Mat, Par};

/// Side of the square matrices: large enough that no start counts, small enough for a third cache.
const SIDE: usize = 1500;

/// Operations a nanosecond of faer's product of square matrices on so many threads.
///
/// Units: GFlop/s.
pub fn product_rate<T: faer::traits::RealField + From<f32>>(threads: usize) -> f64 {
    let entry = |i: usize, j: usize| T::from(((i * 7 + j * 3) % 11) as f32 - 5.0);
    let (a, b) = (Mat::<T>::from_fn(SIDE, SIDE, entry), Mat::<T>::from_fn(SIDE, SIDE, entry));
    let mut c = Mat::<T>::zeros(SIDE, SIDE);
    let par = if threads == 1 { Par::Seq } else { Par::rayon(threads) };
    let start = Instant::now();
    matmul(c.as_mut(), Accum::Replace, a.as_ref(), b.as_ref(), T::from(1.0), par);
    let elapsed = start.elapsed().as_secs_f64();
    // A product that nobody looks at need not be made.
    std::hint::black_box(&c);
    2.0 * (SIDE as f64).powi(3) / elapsed / 1e9
}
