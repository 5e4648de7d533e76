//! Sums over several vectors that stand side by side, the numbers of one row next to each other.
//! Rows are taken in parts of a fixed length and the parts' sums added in their order, so that any
//! number of threads gives the same bits.

use rayon::prelude::*;

use super::vectors::{SAFE_SQUARES, norm};

/// Rows of a part.
pub(super) const PART_ROWS: usize = 256;

/// Euclidean norms of the columns.
///
/// Shapes: `rows` any number of rows × `columns`.
pub(super) fn norms(rows: &[f64], columns: usize) -> Vec<f64> {
    let parts = rows.par_chunks(PART_ROWS * columns.max(1)).map(|part| {
        let mut squares = vec![0.0; columns];
        for row in part.chunks_exact(columns) {
            squares.iter_mut().zip(row).for_each(|(sum, x)| *sum += x * x);
        }
        squares
    });
    roots(sum(parts.collect(), columns), rows)
}

/// Norms from sums of squares, those of numbers too small or too large to square worked out again.
pub(super) fn roots(squares: Vec<f64>, rows: &[f64]) -> Vec<f64> {
    let columns = squares.len();
    let again = |j: usize| norm(&rows.iter().skip(j).step_by(columns).copied().collect::<Vec<_>>());
    let root = |(j, square): (usize, f64)| match SAFE_SQUARES.contains(&square) {
        true => square.sqrt(),
        false => again(j),
    };
    squares.into_iter().enumerate().map(root).collect()
}

/// Sums of the parts' sums, one for each column.
pub(super) fn sum(parts: Vec<Vec<f64>>, columns: usize) -> Vec<f64> {
    parts.into_iter().fold(vec![0.0; columns], |mut sums, part| {
        sums.iter_mut().zip(part).for_each(|(sum, part)| *sum += part);
        sums
    })
}

/// Scalar products of the columns of `a` with those of `b`.
///
/// Shapes: both any number of rows × `columns`.
pub(super) fn dots(a: &[f64], b: &[f64], columns: usize) -> Vec<f64> {
    let len = PART_ROWS * columns.max(1);
    let parts = a.par_chunks(len).zip(b.par_chunks(len)).map(|(a, b)| {
        let mut sums = vec![0.0; columns];
        for (a, b) in a.chunks_exact(columns).zip(b.chunks_exact(columns)) {
            for j in 0..columns {
                sums[j] += a[j] * b[j];
            }
        }
        sums
    });
    sum(parts.collect(), columns)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sums_over_parts_equal_plain_ones_and_have_the_same_bits_for_any_threads() {
        let (rows, columns) = (3 * PART_ROWS + 17, 5);
        let value = |seed: f64| move |k: usize| (seed * (k + 1) as f64).sin();
        let a: Vec<f64> = (0..rows * columns).map(value(0.37)).collect();
        let b: Vec<f64> = (0..rows * columns).map(value(0.71)).collect();
        let on = |threads: usize| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| (norms(&a, columns), dots(&a, &b, columns)))
        };
        let (norms, dots) = on(1);
        assert_eq!((norms.clone(), dots.clone()), on(3));
        for j in 0..columns {
            let column = |x: &[f64]| x.iter().skip(j).step_by(columns).copied().collect::<Vec<_>>();
            let plain: f64 = column(&a).iter().zip(column(&b)).map(|(a, b)| a * b).sum();
            assert!((dots[j] - plain).abs() < 1e-11, "{} is not {plain}", dots[j]);
            assert!((norms[j] - norm(&column(&a))).abs() < 1e-12);
        }
    }

    #[test]
    fn norms_of_tiny_and_huge_columns_do_not_vanish() {
        let found = norms(&[3e-200, 0.0, 3e200, 4e-200, 0.0, 4e200], 3);
        for (found, expected) in found.iter().zip([5e-200, 0.0, 5e200]) {
            assert!((found - expected).abs() <= 1e-15 * expected, "{found:e} is not {expected:e}");
        }
        assert_eq!(norms(&[], 2), [0.0, 0.0]);
    }
}
