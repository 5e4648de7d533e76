//! Gauss–Jordan elimination of the thesis's Appendix A, pivot by pivot and a panel of pivots at a time.

use std::ops::Range;

use faer::linalg::matmul::matmul;
use faer::prelude::*;
use faer::{Accum, Par};
use rayon::prelude::*;

use crate::solve::k11::NotPositive;

/// Inverts a symmetric positive definite matrix in place by Gauss–Jordan elimination without
/// pivoting; the inner loop over rows runs on the current rayon pool with the same bits for any
/// number of threads.
///
/// The thesis eliminates in two n × n matrices side by side (Figure A.2). Column i of the first is
/// a unit vector once it is eliminated, and column i of the second is one until then, so both are
/// kept in one n × n array; the arithmetic is that of (A.1) and (A.2) without the multiplications
/// by known zeros and ones.
///
/// Shapes: `a` n × n, row-major. Units: N/m in, m/N out.
///
/// # Errors
/// [`NotPositive`] with the row of the first pivot that is not positive.
///
/// Source: thesis Figure A.1, (A.1), (A.2).
pub fn invert_plainly(a: &mut [f64], n: usize) -> Result<(), NotPositive> {
    let mut pivot_row = vec![0.0; n];
    for i in 0..n {
        let pivot = a[i * n + i];
        if !(pivot > 0.0 && pivot.is_finite()) {
            return Err(NotPositive { row: i });
        }
        let row_i = &mut a[i * n..(i + 1) * n];
        row_i[i] = 1.0;
        for x in row_i.iter_mut() {
            *x /= pivot;
        }
        pivot_row.copy_from_slice(row_i);
        a.par_chunks_exact_mut(n).enumerate().with_min_len(16).for_each(|(k, row_k)| {
            if k == i {
                return;
            }
            let factor = row_k[i];
            row_k[i] = 0.0;
            for (x, p) in row_k.iter_mut().zip(&pivot_row) {
                *x -= factor * p;
            }
        });
    }
    Ok(())
}

/// Inverts a symmetric positive definite matrix in place by Gauss–Jordan elimination without
/// pivoting, on the current rayon pool with the same bits for any number of threads.
///
/// The pivots are those of [`invert_plainly`], in the same order. With `I` the rows of
/// one panel of pivots, its steps on single rows become steps on the rows of `I` together: `A_II`
/// is inverted by the same method, row panel `A_I` is multiplied by that inverse, and every other
/// row takes off its `A_KI` times the row panel. What was one pass over the matrix per pivot is one
/// per panel, as products of matrices.
///
/// Shapes: `a` n × n, row-major. Units: N/m in, m/N out.
///
/// # Errors
/// [`NotPositive`] with the row of the first pivot that is not positive.
///
/// Source: thesis Figure A.1, (A.1), (A.2), with blocks in the place of numbers.
pub fn invert(a: &mut [f64], n: usize) -> Result<(), NotPositive> {
    let Some(Cut { width, height }) = Cut::of(n) else {
        return invert_plainly(a, n);
    };
    let mut row_panel = vec![0.0; n * width];
    let mut column_panel = vec![0.0; n * width];
    let mut inverse = square_of(a, n, 0..width.min(n));
    let mut inverted = invert(&mut inverse, width.min(n));
    for from in (0..n).step_by(width) {
        let pivots = width.min(n - from);
        inverted.map_err(|e| NotPositive { row: from + e.row })?;
        let row_panel = RowPanel::new(&mut row_panel[..n * pivots], a, from, &inverse);
        // The next `A_II` is worked out first, to be inverted beside the elimination of all rows:
        // it is the one piece of work that cannot be shared out.
        let next = from + pivots..(from + pivots + width).min(n);
        let mut next_inverse = row_panel.next_square(a, next.clone());
        let invert_next = || invert(&mut next_inverse, next.len());
        let eliminate = || {
            a.par_chunks_mut(height * n)
                .zip(column_panel.par_chunks_mut(height * width))
                .enumerate()
                .with_max_len(1)
                .for_each(|(k, (rows, factors))| match (k * height).checked_sub(from) {
                    Some(first) if first < pivots => row_panel.write(first, rows),
                    _ => row_panel.eliminate(rows, factors),
                });
        };
        (inverted, ()) = rayon::join(invert_next, eliminate);
        inverse = next_inverse;
    }
    Ok(())
}

/// The square of `a` in some rows and the same columns, row-major.
fn square_of(a: &[f64], n: usize, rows: Range<usize>) -> Vec<f64> {
    a[rows.start * n..rows.end * n]
        .chunks_exact(n)
        .flat_map(|row| &row[rows.clone()])
        .copied()
        .collect()
}

/// Product of a row-major square matrix and a vector, rows in parallel.
pub fn mul(a: &[f64], x: &[f64]) -> Vec<f64> {
    if x.is_empty() {
        return Vec::new();
    }
    a.par_chunks_exact(x.len())
        .with_min_len(16)
        .map(|row| row.iter().zip(x).map(|(a, x)| a * x).sum())
        .collect()
}

/// How a matrix is cut: a function of its size only, so that the bits do not depend on threads.
#[derive(Clone, Copy)]
struct Cut {
    /// Pivots of a panel.
    width: usize,
    /// Rows of a task; divides `width`.
    height: usize,
}

impl Cut {
    /// `None` where a matrix is small enough to be eliminated pivot by pivot.
    ///
    /// A wide panel reads the matrix seldom; the inverse of a narrow one is there before the
    /// elimination beside it ends.
    const fn of(n: usize) -> Option<Self> {
        match n {
            0..=24 => None,
            25..=192 => Some(Self { width: 16, height: 16 }),
            193..=1600 => Some(Self { width: 64, height: 32 }),
            _ => Some(Self { width: 256, height: 64 }),
        }
    }
}

/// Rows `I` of the matrix multiplied by `A_II⁻¹`, with `A_II⁻¹` itself in the columns `I`.
///
/// Shapes: pivots × n, in tiles of [`TILE`] columns; each tile transposed, column-major.
struct RowPanel<'a> {
    tiles: &'a [f64],
    n: usize,
    from: usize,
    pivots: usize,
}

/// Columns of a tile of the row panel: a tile of 128 rows stays in the second-level cache.
const TILE: usize = 192;

impl<'a> RowPanel<'a> {
    /// Works the panel out into `tiles`.
    fn new(tiles: &'a mut [f64], a: &[f64], from: usize, inverse: &[f64]) -> Self {
        let pivots = inverse.len().isqrt();
        let n = tiles.len() / pivots;
        // Row-major matrices are their transposes by columns.
        let rows = MatRef::from_column_major_slice(&a[from * n..(from + pivots) * n], n, pivots);
        let inverse = MatRef::from_column_major_slice(inverse, pivots, pivots);
        tiles.par_chunks_mut(TILE * pivots).enumerate().with_max_len(1).for_each(|(t, tile)| {
            let extent = tile.len() / pivots;
            let mut tile = MatMut::from_column_major_slice_mut(tile, extent, pivots);
            let old = rows.subrows(t * TILE, extent);
            matmul(tile.as_mut(), Accum::Replace, old, inverse, 1.0, Par::Seq);
            for i in (0..extent).filter(|i| (from..from + pivots).contains(&(t * TILE + i))) {
                tile.as_mut().row_mut(i).copy_from(inverse.row(t * TILE + i - from));
            }
        });
        Self { tiles, n, from, pivots }
    }

    /// Tiles with their first columns in the matrix.
    fn tiles(&self) -> impl Iterator<Item = (usize, MatRef<'_, f64>)> {
        self.tiles.chunks(TILE * self.pivots).enumerate().map(|(t, tile)| {
            let extent = tile.len() / self.pivots;
            (t * TILE, MatRef::from_column_major_slice(tile, extent, self.pivots))
        })
    }

    /// Puts rows of the panel, from the `first`, into the matrix.
    fn write(&self, first: usize, rows: &mut [f64]) {
        let count = rows.len() / self.n;
        let mut rows = MatMut::from_column_major_slice_mut(rows, self.n, count);
        for (column, tile) in self.tiles() {
            let mut into = rows.as_mut().subrows_mut(column, tile.nrows());
            into.copy_from(tile.subcols(first, count));
        }
    }

    /// The square of `a` in the rows `next` with their `A_KI` times the panel taken off.
    fn next_square(&self, a: &[f64], next: Range<usize>) -> Vec<f64> {
        let mut square = square_of(a, self.n, next.clone());
        let rows = a[next.start * self.n..next.end * self.n].chunks_exact(self.n);
        let of_panel = self.from..self.from + self.pivots;
        let factors: Vec<f64> = rows.flat_map(|row| &row[of_panel.clone()]).copied().collect();
        let factors = MatRef::from_column_major_slice(&factors, self.pivots, next.len());
        let mut into = MatMut::from_column_major_slice_mut(&mut square, next.len(), next.len());
        for (column, tile) in self.tiles() {
            let end = (column + tile.nrows()).min(next.end);
            let start = column.max(next.start);
            if start < end {
                let into = into.as_mut().subrows_mut(start - next.start, end - start);
                let tile = tile.subrows(start - column, end - start);
                matmul(into, Accum::Add, tile, factors, -1.0, Par::Seq);
            }
        }
        square
    }

    /// Takes their `A_KI` times the panel off other rows; `factors` is scratch for `A_KI`.
    fn eliminate(&self, rows: &mut [f64], factors: &mut [f64]) {
        let factors = &mut factors[..rows.len() / self.n * self.pivots];
        for (row, factors) in rows.chunks_exact_mut(self.n).zip(factors.chunks_mut(self.pivots)) {
            let of_panel = &mut row[self.from..self.from + self.pivots];
            factors.copy_from_slice(of_panel);
            of_panel.fill(0.0);
        }
        let count = rows.len() / self.n;
        let factors = MatRef::from_column_major_slice(factors, self.pivots, count);
        let mut rows = MatMut::from_column_major_slice_mut(rows, self.n, count);
        for (column, tile) in self.tiles() {
            let into = rows.as_mut().subrows_mut(column, tile.nrows());
            matmul(into, Accum::Add, tile, factors, -1.0, Par::Seq);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// A positive definite matrix with entries from a formula, row-major.
    fn definite(n: usize) -> Vec<f64> {
        let entry = |i: usize, j: usize| ((i * j) as f64 * 0.7 + (i + j) as f64).sin();
        (0..n * n).map(|k| if k % (n + 1) == 0 { n as f64 } else { entry(k / n, k % n) }).collect()
    }

    #[test]
    fn panels_give_the_inverse_of_single_pivots_with_the_same_bits_for_any_threads() {
        for n in [1, 24, 25, 47, 192, 193, 257, 330, 1601] {
            let mut plain = definite(n);
            invert_plainly(&mut plain, n).unwrap();
            let largest = plain.iter().fold(0.0f64, |m, x| m.max(x.abs()));
            let inverses = [1, 2, 4, 7].map(|threads| {
                let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
                let mut inverse = definite(n);
                pool.install(|| invert(&mut inverse, n)).unwrap();
                inverse
            });
            for (a, b) in plain.iter().zip(&inverses[0]) {
                assert!((a - b).abs() <= 1e-13 * largest, "n {n}: {a:e} {b:e}");
            }
            for other in &inverses[1..] {
                assert!(other == &inverses[0], "n {n} depends on the number of threads");
            }
        }
    }

    #[test]
    fn failing_pivot_is_named_in_any_panel() {
        for (n, row) in [(20, 7), (100, 0), (100, 17), (300, 70), (300, 299)] {
            for bad in [-1.0, f64::NAN, f64::INFINITY] {
                let mut a = definite(n);
                a[row * n + row] = bad;
                assert_eq!(invert(&mut a, n), Err(NotPositive { row }), "n {n}, {bad}");
            }
        }
    }

    /// Figure A.1 letter by letter: two matrices, all columns.
    fn invert_as_printed(global: &mut [Vec<f64>]) -> Vec<Vec<f64>> {
        let n = global.len();
        let mut inverse = vec![vec![0.0; n]; n];
        for (i, row) in inverse.iter_mut().enumerate() {
            row[i] = 1.0;
        }
        for i in 0..n {
            let pivot = global[i][i];
            for j in 0..n {
                global[i][j] /= pivot;
                inverse[i][j] /= pivot;
            }
            for k in (0..n).filter(|&k| k != i) {
                let factor = global[k][i];
                for j in 0..n {
                    global[k][j] -= factor * global[i][j];
                    inverse[k][j] -= factor * inverse[i][j];
                }
            }
        }
        inverse
    }

    proptest! {
        #[test]
        fn one_array_gives_the_numbers_of_the_printed_two(seed in prop::collection::vec(-1.0..1.0f64, 49)) {
            let n = 7;
            let mut a = vec![0.0; n * n];
            for i in 0..n {
                for j in 0..n {
                    a[i * n + j] = (0..n).map(|k| seed[i * n + k] * seed[j * n + k]).sum::<f64>()
                        + if i == j { 1.0 } else { 0.0 };
                }
            }
            let mut rows: Vec<Vec<f64>> = a.chunks(n).map(<[f64]>::to_vec).collect();
            let printed = invert_as_printed(&mut rows);
            invert_plainly(&mut a, n).unwrap();
            // Equal, not close: the left-out operations are exact.
            prop_assert_eq!(a, printed.concat());
        }
    }

    #[test]
    fn indefinite_matrix_is_refused_at_its_pivot() {
        let mut a = vec![1.0, 2.0, 2.0, 1.0];
        assert_eq!(invert_plainly(&mut a, 2), Err(NotPositive { row: 1 }));
    }
}
