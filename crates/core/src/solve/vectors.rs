//! Sums of vectors: norm, scalar product, difference; and of several vectors that stand side by side, the
//! numbers of one row next to each other. Rows are taken in parts of a fixed length and the parts' sums added
//! in their order, so that any number of threads gives the same bits.

use rayon::prelude::*;

/// Euclidean norm, scaled so that tiny and huge units neither vanish nor overflow.
pub(crate) fn norm(v: &[f64]) -> f64 {
    let square = sum_of_squares(v, |x| x);
    if SAFE_SQUARES.contains(&square) {
        return square.sqrt();
    }
    // Too small or too large to square as they are.
    let scale = v.iter().fold(0.0f64, |m, x| m.max(x.abs()));
    if scale == 0.0 || !scale.is_finite() {
        return scale;
    }
    scale * sum_of_squares(v, |x| x / scale).sqrt()
}

/// Sums of squares in which nothing that matters was lost below or above the range of a double.
pub(super) const SAFE_SQUARES: std::ops::Range<f64> = 1e-200..1e200;
/// Sums that run beside each other: always as many, so that the bits are always the same.
const SUMS: usize = 8;

#[inline]
fn sum_of_squares(v: &[f64], scaled: impl Fn(f64) -> f64) -> f64 {
    let mut sums = [0.0; SUMS];
    let (chunks, rest) = v.as_chunks::<SUMS>();
    for (sum, &x) in sums.iter_mut().zip(rest) {
        *sum = scaled(x) * scaled(x);
    }
    for chunk in chunks {
        for (sum, &x) in sums.iter_mut().zip(chunk) {
            *sum += scaled(x) * scaled(x);
        }
    }
    sums.iter().sum()
}

/// Largest absolute value.
pub(super) fn largest(v: &[f64]) -> f64 {
    v.iter().fold(0.0, |most: f64, x| most.max(x.abs()))
}

/// Scalar product `aᵀ b`.
pub(super) fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// `a − b`.
pub(super) fn subtract(a: &[f64], b: &[f64]) -> Vec<f64> {
    a.iter().zip(b).map(|(a, b)| a - b).collect()
}

/// `x + scale · y` in the place of `x`.
pub(super) fn add_scaled(x: &mut [f64], scale: f64, y: &[f64]) {
    for (x, y) in x.iter_mut().zip(y) {
        *x += scale * y;
    }
}

/// Length of the longest of 3-vectors that stand one behind the other; of the unknown, where some
/// axes of a node are known, that of neighbours, which is of the same size.
pub(super) fn node_max(v: &[f64]) -> f64 {
    let length = |node: &[f64]| node.iter().map(|x| x * x).sum::<f64>();
    v.chunks(3).map(length).fold(0.0, f64::max).sqrt()
}

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
