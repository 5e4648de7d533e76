//! Forward and backward substitution with the panel of one front.

use std::ops::Range;

use pulp::{Arch, Simd, WithSimd};
use rayon::prelude::*;

use super::Real;
use super::dense::TASK_SLABS;
use super::kernel::{
    Factors, Onto, divide_by_square, subtract_deep, subtract_dots, subtract_product,
};
use super::slabs::Slabs;

/// Panels times right-hand sides above this are split into tasks.
const TASK_PRODUCTS: usize = 400_000;
/// Columns of a panel that one task of a backward substitution takes.
const TASK_COLUMNS: usize = 96;

/// Numbers of a row for so many right-hand sides: one, or whole vectors.
pub(super) fn width<T: Real>(columns: usize) -> usize {
    match columns {
        1 => 1,
        _ => columns.next_multiple_of(T::SLAB / 3),
    }
}

/// One front's panel `[L11; L21]`.
///
/// Shapes: `values` as `slabs` says.
#[derive(Clone, Copy)]
pub(super) struct Panel<'a, T> {
    pub values: &'a [T],
    pub slabs: Slabs,
}

impl<T: Real> Panel<'_, T> {
    /// `x1 ← L11⁻¹ x1`, `x2 ← x2 − L21 x1`.
    ///
    /// Shapes: `x` = [x1; x2], the front's rows as slabs have them, each with `width` numbers, one
    /// for each right-hand side.
    pub fn forward(self, x: &mut [T], width: usize) {
        let (arch, slabs) = (Arch::new(), self.slabs);
        let (x1, x2) = x.split_at_mut(slabs.pivot_slabs() * slabs.height * width);
        arch.dispatch(ForwardTop { panel: self, x: x1, width });
        let x1 = &x1[..slabs.pivots * width];
        let strip = slabs.height * width;
        let below = |first: usize, x: &mut [T]| {
            arch.dispatch(ForwardBelow { panel: self, first, x1, x, width });
        };
        match self.is_split(width) {
            true => x2
                .par_chunks_mut(TASK_SLABS * strip)
                .enumerate()
                .for_each(|(k, x)| below(slabs.pivot_slabs() + k * TASK_SLABS, x)),
            false => below(slabs.pivot_slabs(), x2),
        }
    }

    /// `x1 ← L11⁻ᵀ (x1 − L21ᵀ x2)`.
    ///
    /// Shapes: as in [`Panel::forward`].
    pub fn backward(self, x: &mut [T], width: usize) {
        let (arch, slabs) = (Arch::new(), self.slabs);
        let (x1, x2) = x.split_at_mut(slabs.pivot_slabs() * slabs.height * width);
        let x1 = &mut x1[..slabs.pivots * width];
        let x2 = &*x2;
        let above = |first: usize, x1: &mut [T]| {
            let columns = first..first + x1.len() / width;
            arch.dispatch(BackwardBelow { panel: self, columns, x1, x2, width });
        };
        match self.is_split(width) {
            true => x1
                .par_chunks_mut(TASK_COLUMNS * width)
                .enumerate()
                .for_each(|(k, x1)| above(k * TASK_COLUMNS, x1)),
            false => above(0, x1),
        }
        arch.dispatch(BackwardTop { panel: self, x: x1, width });
    }

    fn is_split(self, width: usize) -> bool {
        self.slabs.pivots * self.slabs.rest * width > TASK_PRODUCTS
    }
}

impl<'a, T: Real> Panel<'a, T> {
    /// Some columns of a slab.
    #[inline(always)]
    fn slab(self, slab: usize, columns: Range<usize>) -> &'a [T] {
        let start = self.slabs.start(slab);
        &self.values[start + columns.start * T::SLAB..start + columns.end * T::SLAB]
    }

    /// The square on the diagonal of a slab of pivots, and its columns.
    #[inline(always)]
    fn square(self, slab: usize) -> (&'a [T], usize) {
        let first = slab * T::SLAB;
        let columns = T::SLAB.min(self.slabs.pivots - first);
        (self.slab(slab, first..first + columns), columns)
    }
}

/// `x1 ← L11⁻¹ x1`, slab by slab.
struct ForwardTop<'a, 'x, T> {
    panel: Panel<'a, T>,
    x: &'x mut [T],
    width: usize,
}

impl<T: Real> WithSimd for ForwardTop<'_, '_, T> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { panel, x, width } = self;
        let mut inverses = [T::ZERO; SLAB_MAX];
        for s in 0..panel.slabs.pivot_slabs() {
            let (done, own) = x.split_at_mut(s * T::SLAB * width);
            let (square, columns) = panel.square(s);
            subtract_slab(simd, own, panel.slab(s, 0..s * T::SLAB), done, width, columns);
            if width == 1 {
                for j in 0..columns {
                    own[j] = own[j] / square[j * T::SLAB + j];
                    let (factor, below) =
                        (own[j], &square[j * T::SLAB + j + 1..][..columns - j - 1]);
                    own[j + 1..].iter_mut().zip(below).for_each(|(x, &l)| *x -= l * factor);
                }
                continue;
            }
            for j in 0..columns {
                inverses[j] = T::ONE / square[j * T::SLAB + j];
            }
            divide_by_square(simd, own, square, &inverses, width, columns);
        }
    }
}

/// Rows of the largest slab.
const SLAB_MAX: usize = 48;

/// Takes the product of a slab and rows of `x` off the slab's rows.
#[inline(always)]
fn subtract_slab<S: Simd, T: Real>(
    simd: S,
    own: &mut [T],
    slab: &[T],
    x: &[T],
    width: usize,
    rows: usize,
) {
    if width == 1 {
        let into = (&mut own[..T::SLAB], Onto::There);
        return subtract_product(simd, into, slab, Factors::One { values: x }, T::SLAB, 1);
    }
    subtract_deep(simd, own, x, slab, width, rows);
}

/// `x2 ← x2 − L21 x1` for some slabs.
struct ForwardBelow<'a, 'x, T> {
    panel: Panel<'a, T>,
    first: usize,
    x1: &'x [T],
    x: &'x mut [T],
    width: usize,
}

impl<T: Real> WithSimd for ForwardBelow<'_, '_, T> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { panel, first, x1, x, width } = self;
        for (k, own) in x.chunks_exact_mut(T::SLAB * width).enumerate() {
            let slab = panel.slab(first + k, 0..panel.slabs.pivots);
            subtract_slab(simd, own, slab, x1, width, T::SLAB);
        }
    }
}

/// `x1 ← x1 − L21ᵀ x2` for some columns.
struct BackwardBelow<'a, 'x, T> {
    panel: Panel<'a, T>,
    columns: Range<usize>,
    x1: &'x mut [T],
    x2: &'x [T],
    width: usize,
}

impl<T: Real> WithSimd for BackwardBelow<'_, '_, T> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { panel, columns, x1, x2, width } = self;
        for (i, x2) in x2.chunks_exact(T::SLAB * width).enumerate() {
            let slab = panel.slab(panel.slabs.pivot_slabs() + i, columns.clone());
            subtract_transposed(simd, x1, slab, x2, width);
        }
    }
}

/// Takes the product of a transposed slab and its rows of `x` off the rows of its columns.
#[inline(always)]
fn subtract_transposed<S: Simd, T: Real>(
    simd: S,
    into: &mut [T],
    slab: &[T],
    x: &[T],
    width: usize,
) {
    if width == 1 {
        return subtract_dots(simd, into, slab, x);
    }
    let columns = into.len() / width;
    let b = Factors::Columns { strips: slab };
    subtract_product(simd, (into, Onto::There), x, b, width, columns);
}

/// `x1 ← L11⁻ᵀ x1`, slab by slab from the last.
struct BackwardTop<'a, 'x, T> {
    panel: Panel<'a, T>,
    x: &'x mut [T],
    width: usize,
}

impl<T: Real> WithSimd for BackwardTop<'_, '_, T> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { panel, x, width } = self;
        for s in (0..panel.slabs.pivot_slabs()).rev() {
            let (above, own) = x.split_at_mut(s * T::SLAB * width);
            let (square, columns) = panel.square(s);
            let own = &mut own[..columns * width];
            for j in (0..columns).rev() {
                let (own, done) = own[j * width..].split_at_mut(width);
                let column = &square[j * T::SLAB + j..][..columns - j];
                for (done, &l) in done.chunks_exact(width).zip(&column[1..]) {
                    own.iter_mut().zip(done).for_each(|(x, &done)| *x -= l * done);
                }
                own.iter_mut().for_each(|x| *x = *x / column[0]);
            }
            let slab = panel.slab(s, 0..s * T::SLAB);
            if width == 1 {
                // The last slab may have fewer rows than its strips have numbers.
                let mut strip = [T::ZERO; SLAB_MAX];
                strip[..columns].copy_from_slice(own);
                subtract_dots(simd, above, slab, &strip[..T::SLAB]);
                continue;
            }
            subtract_transposed(simd, above, slab, own, width);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn substitution_equals_plain<T: Real>(size: usize, pivots: usize, good: f64) {
        let slabs = Slabs::new::<T>(pivots, size - pivots);
        let value =
            |i: usize, j: usize| 0.1 * if i == j { 30.0 } else { ((i + 7 * j) as f64).sin() };
        let mut values = vec![T::ZERO; slabs.panel_len()];
        for j in 0..pivots {
            for i in j..size {
                values[slabs.panel_row(i) + j * slabs.height] = T::from_f64(value(i, j));
            }
        }
        let panel = Panel { values: &values, slabs };
        for columns in [1, 2, 3, 5, 21] {
            let width = width::<T>(columns);
            let b = |i: usize, k: usize| ((i + size * k) as f64 * 0.3).cos();
            let mut x = vec![T::ZERO; slabs.padded_rows() * width];
            for i in 0..size {
                for k in 0..columns {
                    x[slabs.padded(i) * width + k] = T::from_f64(b(i, k));
                }
            }
            let mut plain: Vec<Vec<f64>> =
                (0..columns).map(|k| (0..size).map(|i| b(i, k)).collect()).collect();
            let agrees = |x: &[T], plain: &[Vec<f64>]| {
                for (k, plain) in plain.iter().enumerate() {
                    let largest = plain.iter().fold(0.0f64, |m, x| m.max(x.abs()));
                    for i in 0..size {
                        let found = x[slabs.padded(i) * width + k].to_f64();
                        assert!((found - plain[i]).abs() < good * largest, "row {i} of {size}");
                    }
                }
            };
            for x in &mut plain {
                for j in 0..pivots {
                    x[j] /= value(j, j);
                    for i in j + 1..size {
                        x[i] -= value(i, j) * x[j];
                    }
                }
            }
            panel.forward(&mut x, width);
            agrees(&x, &plain);
            for x in &mut plain {
                for j in (0..pivots).rev() {
                    let sum: f64 = (j + 1..size).map(|i| value(i, j) * x[i]).sum();
                    x[j] = (x[j] - sum) / value(j, j);
                }
            }
            panel.backward(&mut x, width);
            agrees(&x, &plain);
        }
    }

    #[test]
    fn substitution_equals_plain_substitution() {
        let sizes =
            [(1, 1), (3, 3), (4, 2), (9, 8), (49, 48), (700, 6), (1200, 5), (40, 33), (2600, 200)];
        for (size, pivots) in sizes {
            substitution_equals_plain::<f64>(size, pivots, 1e-11);
            substitution_equals_plain::<f32>(size, pivots, 1e-3);
        }
    }
}
