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
/// Rows and columns of a task in a front worked on by several threads.
const TILE: usize = 256;

/// Whether the tiles of a front are tasks or one after another; the arithmetic is the same.
#[derive(Clone, Copy, PartialEq)]
pub(super) enum Tasks {
    Serial,
    Parallel,
}

/// Factors the panel `[L11; L21]` of a front in place; `Err` is the pivot that failed.
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
        let done = MatRef::from_column_major_slice(done, size, from);
        let block = MatMut::from_column_major_slice_mut(&mut rest[..width * size], size, width);
        let (mut top, mut below) = block.split_at_row_mut(from).1.split_at_row_mut(width);
        let done = done.split_at_row(from).1;
        let (done_top, done_below) = done.split_at_row(width);
        if from > 0 {
            subtract_symmetric(top.as_mut(), done_top, Accum::Add);
        }
        factor_square(top.as_mut()).map_err(|pivot| from + pivot)?;
        let top = top.as_ref();
        let finish = |done: MatRef<'_, T>, mut tile: MatMut<'_, T>| {
            if from > 0 {
                let minus = T::MINUS_ONE;
                matmul(tile.as_mut(), Accum::Add, done, done_top.transpose(), minus, Par::Seq);
            }
            solve_lower_triangular_in_place(top, tile.transpose_mut(), Par::Seq);
        };
        let mut tiles = Vec::with_capacity(below.nrows().div_ceil(TILE));
        let mut first = from + width;
        while below.nrows() > 0 {
            let height = TILE.min(below.nrows());
            let (tile, rest) = below.split_at_row_mut(height);
            tiles.push((done_below.subrows(first - from - width, height), tile));
            below = rest;
            first += height;
        }
        match tasks {
            Tasks::Serial => tiles.into_iter().for_each(|(done, tile)| finish(done, tile)),
            Tasks::Parallel => tiles.into_par_iter().for_each(|(done, tile)| finish(done, tile)),
        }
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
    let product = |tile: MatMut<'_, T>, left: MatRef<'_, T>, right: MatRef<'_, T>| {
        matmul(tile, Accum::Replace, left, right.transpose(), T::MINUS_ONE, Par::Seq);
    };
    match tasks {
        Tasks::Serial => {
            for chunk in contribution.chunks_mut(TILE * rest).enumerate() {
                let (below, l_below, l_top) = tile_column(l21, chunk);
                product(below, l_below, l_top);
            }
        }
        Tasks::Parallel => {
            contribution.par_chunks_mut(TILE * rest).enumerate().for_each(|chunk| {
                let (mut below, l_below, l_top) = tile_column(l21, chunk);
                let mut tiles = Vec::new();
                let mut first = 0;
                while below.nrows() > 0 {
                    let height = TILE.min(below.nrows());
                    let (tile, rest) = below.split_at_row_mut(height);
                    tiles.push((tile, l_below.subrows(first, height)));
                    below = rest;
                    first += height;
                }
                tiles.into_par_iter().for_each(|(tile, left)| product(tile, left, l_top));
            });
        }
    }
}

/// Forms the diagonal tile of the `j`-th tile column; what is left to do is the product of the
/// other two parts returned, into the first.
fn tile_column<'a, T: Real>(
    l21: MatRef<'a, T>,
    (j, columns): (usize, &'a mut [T]),
) -> (MatMut<'a, T>, MatRef<'a, T>, MatRef<'a, T>) {
    let (rest, from) = (l21.nrows(), j * TILE);
    let width = columns.len() / rest;
    let columns = MatMut::from_column_major_slice_mut(columns, rest, width);
    let (top, below) = columns.split_at_row_mut(from).1.split_at_row_mut(width);
    let l_top = l21.subrows(from, width);
    subtract_symmetric(top, l_top, Accum::Replace);
    (below, l21.split_at_row(from + width).1, l_top)
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
