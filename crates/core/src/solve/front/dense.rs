//! Partial Cholesky factorisation of one dense front, in tiles whose size depends on the front
//! only, so that any number of threads gives the same bits.

use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::cholesky::llt::factor::{LltError, cholesky_in_place, cholesky_in_place_scratch};
use faer::linalg::matmul::matmul;
use faer::linalg::matmul::triangular::{self, BlockStructure};
use faer::linalg::triangular_solve::solve_lower_triangular_in_place;
use faer::prelude::*;
use faer::{Accum, Par};
use rayon::prelude::*;

use super::Real;

/// Columns factored at once.
const PANEL_COLUMNS: usize = 128;
/// Rows of a task in a panel.
const PANEL_ROWS: usize = 192;
/// Rows and columns of a task in a contribution block.
const TILE: usize = 192;

/// Whether the tiles of a front are tasks or one after another.
#[derive(Clone, Copy, PartialEq)]
pub(super) enum Tasks {
    Serial,
    Parallel,
}

impl Tasks {
    /// Calls `work` on every tile.
    fn run<I: Send>(self, tiles: Vec<I>, work: impl Fn(I) + Sync + Send) {
        match self {
            Self::Serial => tiles.into_iter().for_each(work),
            Self::Parallel => tiles.into_par_iter().with_max_len(1).for_each(work),
        }
    }

    /// Rows or columns of a tile: in a serial front one tile is all there is.
    fn extent(self, parallel: usize, whole: usize) -> usize {
        match self {
            Self::Serial => whole.max(1),
            Self::Parallel => parallel,
        }
    }
}

/// Factors the panel `[L11; L21]` of a front in place, left-looking by block columns; `Err` is
/// the pivot that failed.
///
/// Shapes: `panel` size × pivots column-major, its top square symmetric (lower triangle read).
pub(super) fn factor_panel<T: Real>(
    panel: &mut [T],
    size: usize,
    pivots: usize,
    tasks: Tasks,
) -> Result<(), usize> {
    let mut from = 0;
    while from < pivots {
        let width = PANEL_COLUMNS.min(pivots - from);
        let (done, rest) = panel.split_at_mut(from * size);
        let done = MatRef::from_column_major_slice(done, size, from).split_at_row(from).1;
        let block = MatMut::from_column_major_slice_mut(&mut rest[..width * size], size, width);
        let (mut top, mut below) = block.split_at_row_mut(from).1.split_at_row_mut(width);
        let (done_top, done_below) = done.split_at_row(width);
        let height = tasks.extent(PANEL_ROWS, below.nrows());
        if from > 0 {
            let mut tiles = vec![(None, top.as_mut())];
            tiles.extend(row_tiles(below.as_mut(), height).map(|(row, tile)| (Some(row), tile)));
            tasks.run(tiles, |(row, tile): (Option<usize>, MatMut<'_, T>)| {
                let Some(row) = row else {
                    return subtract_symmetric(tile, done_top, Accum::Add);
                };
                let (left, right) = (done_below.subrows(row, tile.nrows()), done_top.transpose());
                matmul(tile, Accum::Add, left, right, T::MINUS_ONE, Par::Seq);
            });
        }
        factor_square(top.as_mut()).map_err(|pivot| from + pivot)?;
        let top = top.as_ref();
        let tiles = row_tiles(below, height).collect();
        tasks.run(tiles, |(_, tile): (usize, MatMut<'_, T>)| {
            solve_lower_triangular_in_place(top, tile.transpose_mut(), Par::Seq);
        });
        from += width;
    }
    Ok(())
}

/// `−L21 L21ᵀ` into the lower triangle of `contribution`; what was there is not read.
///
/// Shapes: `panel` size × pivots, `contribution` rest × rest, both column-major.
pub(super) fn form_contribution<T: Real>(
    contribution: &mut [T],
    panel: &[T],
    size: usize,
    pivots: usize,
    tasks: Tasks,
) {
    let rest = size - pivots;
    if rest == 0 {
        return;
    }
    let l21 = MatRef::from_column_major_slice(panel, size, pivots).split_at_row(pivots).1;
    let side = tasks.extent(TILE, rest);
    let mut tiles = Vec::new();
    for (j, columns) in contribution.chunks_mut(side * rest).enumerate() {
        let columns = MatMut::from_column_major_slice_mut(columns, rest, columns.len() / rest);
        let lower = columns.split_at_row_mut(j * side).1;
        tiles.extend(row_tiles(lower, side).map(|(row, tile)| (j * side + row, j * side, tile)));
    }
    tasks.run(tiles, |(row, column, tile): (usize, usize, MatMut<'_, T>)| {
        let left = l21.subrows(row, tile.nrows());
        if row == column {
            return subtract_symmetric(tile, left, Accum::Replace);
        }
        let right = l21.subrows(column, tile.ncols()).transpose();
        matmul(tile, Accum::Replace, left, right, T::MINUS_ONE, Par::Seq);
    });
}

/// Cuts a matrix into tiles of `height` rows, each with its first row.
fn row_tiles<'a, T: Real>(
    matrix: MatMut<'a, T>,
    height: usize,
) -> impl Iterator<Item = (usize, MatMut<'a, T>)> {
    let mut rest = Some(matrix).filter(|m| m.nrows() > 0);
    let mut first = 0;
    std::iter::from_fn(move || {
        let matrix = rest.take()?;
        let (row, height) = (first, height.min(matrix.nrows()));
        let (tile, tail) = matrix.split_at_row_mut(height);
        rest = Some(tail).filter(|m| m.nrows() > 0);
        first += height;
        Some((row, tile))
    })
}

/// `−A Aᵀ` onto or over the lower triangle.
fn subtract_symmetric<T: Real>(into: MatMut<'_, T>, a: MatRef<'_, T>, accum: Accum) {
    let (lower, full) = (BlockStructure::TriangularLower, BlockStructure::Rectangular);
    let minus = T::MINUS_ONE;
    triangular::matmul(into, lower, accum, a, full, a.transpose(), full, minus, Par::Seq);
}

/// Cholesky factor of a small square in place; `Err` is the failing pivot.
fn factor_square<T: Real>(mut square: MatMut<'_, T>) -> Result<(), usize> {
    let n = square.nrows();
    let params = faer::Spec::default();
    let mut memory = MemBuffer::new(cholesky_in_place_scratch::<T>(n, Par::Seq, params));
    let stack = MemStack::new(&mut memory);
    cholesky_in_place(square.as_mut(), Default::default(), Par::Seq, stack, params)
        .map_err(|LltError::NonPositivePivot { index }| index)?;
    // faer lets a NaN pivot through.
    match (0..n).find(|&j| !square[(j, j)].is_pivot()) {
        Some(j) => Err(j),
        None => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A symmetric matrix, diagonally dominant, column-major.
    fn symmetric(n: usize) -> Vec<f64> {
        let entry = |i: usize, j: usize| ((i * j) as f64 * 0.7 + (i + j) as f64).sin();
        let value = |i, j| if i == j { n as f64 } else { entry(i, j) };
        (0..n * n).map(|k| value(k % n, k / n)).collect()
    }

    /// Elimination of `pivots` columns, entry by entry.
    fn eliminate(a: &mut [f64], n: usize, pivots: usize) {
        for k in 0..pivots {
            let pivot = a[k + n * k].sqrt();
            for i in k..n {
                a[i + n * k] /= pivot;
            }
            for j in k + 1..n {
                for i in j..n {
                    a[i + n * j] -= a[i + n * k] * a[j + n * k];
                }
            }
        }
    }

    #[test]
    fn panel_and_contribution_equal_plain_elimination_around_the_tile_sizes() {
        for (size, pivots) in [(1, 1), (5, 2), (130, 128), (129, 129), (400, 150), (460, 7)] {
            let whole = symmetric(size);
            let mut plain = whole.clone();
            eliminate(&mut plain, size, pivots);
            let rest = size - pivots;
            for tasks in [Tasks::Serial, Tasks::Parallel] {
                let mut panel = whole[..size * pivots].to_vec();
                factor_panel(&mut panel, size, pivots, tasks).unwrap();
                let mut block = vec![f64::NAN; rest * rest];
                form_contribution(&mut block, &panel, size, pivots, tasks);
                for j in 0..pivots {
                    for i in j..size {
                        assert!((panel[i + size * j] - plain[i + size * j]).abs() < 1e-10);
                    }
                }
                for j in 0..rest {
                    for i in j..rest {
                        let at = i + pivots + size * (j + pivots);
                        let expected = plain[at] - whole[at];
                        assert!((block[i + rest * j] - expected).abs() < 1e-10, "({i}, {j})");
                    }
                }
            }
        }
    }

    #[test]
    fn failing_pivot_is_named_in_any_block_column() {
        for pivot in [0, 3, 127, 128, 200] {
            for bad in [-1.0e3, f64::NAN, f64::INFINITY] {
                let mut panel = symmetric(210);
                panel[pivot + 210 * pivot] = bad;
                assert_eq!(factor_panel(&mut panel, 210, 210, Tasks::Serial), Err(pivot));
            }
        }
    }
}
