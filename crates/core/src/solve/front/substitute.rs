//! Forward and backward substitution with the panel of one front.
//!
//! With one right-hand side these run at the speed of memory: kernels of our own that read four
//! columns side by side were no faster than faer's (measured at 10 648 nodes, one to four
//! right-hand sides). Only fewer bytes help, and those are the `f32` factor.

use faer::linalg::matmul::matmul;
use faer::linalg::triangular_solve::{
    solve_lower_triangular_in_place, solve_upper_triangular_in_place,
};
use faer::prelude::*;
use faer::{Accum, Par};

use super::Real;

/// One front's panel `[L11; L21]`.
///
/// Shapes: `values` size × pivots column-major, lower triangle of the top read.
#[derive(Clone, Copy)]
pub(super) struct Panel<'a, T> {
    pub values: &'a [T],
    pub size: usize,
    pub pivots: usize,
}

impl<T: Real> Panel<'_, T> {
    /// `x1 ← L11⁻¹ x1`, `x2 ← x2 − L21 x1`.
    ///
    /// Shapes: `x` = [x1; x2], size × columns column-major.
    pub fn forward(self, x: &mut [T], columns: usize) {
        let (l11, l21) = self.parts();
        let x = MatMut::from_column_major_slice_mut(x, self.size, columns);
        let (mut x1, x2) = x.split_at_row_mut(self.pivots);
        solve_lower_triangular_in_place(l11, x1.as_mut(), Par::Seq);
        if x2.nrows() > 0 {
            matmul(x2, Accum::Add, l21, x1, T::MINUS_ONE, Par::Seq);
        }
    }

    /// `x1 ← L11⁻ᵀ (x1 − L21ᵀ x2)`.
    ///
    /// Shapes: `x` = [x1; x2], size × columns column-major.
    pub fn backward(self, x: &mut [T], columns: usize) {
        let (l11, l21) = self.parts();
        let x = MatMut::from_column_major_slice_mut(x, self.size, columns);
        let (mut x1, x2) = x.split_at_row_mut(self.pivots);
        if x2.nrows() > 0 {
            matmul(x1.as_mut(), Accum::Add, l21.transpose(), x2, T::MINUS_ONE, Par::Seq);
        }
        solve_upper_triangular_in_place(l11.transpose(), x1, Par::Seq);
    }

    /// `L11` and `L21`.
    fn parts(&self) -> (MatRef<'_, T>, MatRef<'_, T>) {
        MatRef::from_column_major_slice(self.values, self.size, self.pivots)
            .split_at_row(self.pivots)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn substitution_equals_plain_substitution() {
        for (size, pivots) in [(1, 1), (3, 3), (4, 2), (9, 8), (700, 6), (1200, 5), (40, 33)] {
            let value = |i: usize, j: usize| if i == j { 3.0 } else { ((i + 7 * j) as f64).sin() };
            let values: Vec<f64> =
                (0..size * pivots).map(|k| 0.1 * value(k % size, k / size)).collect();
            let panel = Panel { values: &values, size, pivots };
            for columns in [1, 2, 3, 5, 21] {
                let b: Vec<f64> = (0..size * columns).map(|i| (i as f64 * 0.3).cos()).collect();
                let (mut plain, mut x) = (b.clone(), b);
                for x in plain.chunks_mut(size) {
                    for j in 0..pivots {
                        x[j] /= values[j * size + j];
                        for i in j + 1..size {
                            x[i] -= values[j * size + i] * x[j];
                        }
                    }
                }
                panel.forward(&mut x, columns);
                let largest = plain.iter().fold(0.0f64, |m, x| m.max(x.abs()));
                assert!(plain.iter().zip(&x).all(|(a, b)| (a - b).abs() < 1e-12 * largest));
                for x in plain.chunks_mut(size) {
                    for j in (0..pivots).rev() {
                        let sum: f64 = (j + 1..size).map(|i| values[j * size + i] * x[i]).sum();
                        x[j] = (x[j] - sum) / values[j * size + j];
                    }
                }
                panel.backward(&mut x, columns);
                let largest = plain.iter().fold(0.0f64, |m, x| m.max(x.abs()));
                assert!(plain.iter().zip(&x).all(|(a, b)| (a - b).abs() < 1e-12 * largest));
            }
        }
    }
}
