//! Partial Cholesky factorisation of one front in slabs. What is a task depends on the front only,
//! so that any number of threads gives the same bits.

use std::ops::Range;

use pulp::{Arch, Simd, WithSimd};
use rayon::prelude::*;

use super::Real;
use super::assembly::{Contribution, add_to_tile};
use super::blocks::Block;
use super::kernel::{
    DEPTH, Factors, Onto, divide_by_square, factor_square, subtract_deep, subtract_product,
};
use super::slabs::Slabs;

/// Slabs of pivots that are factored together.
const FACTORED_SLABS: usize = 4;
/// Slabs of a task.
pub(super) const TASK_SLABS: usize = 8;
/// Slabs of a square of the contribution block.
const TILE_SLABS: usize = 8;

/// Whether the slabs of a front are tasks or one after another.
#[derive(Clone, Copy, PartialEq)]
pub(super) enum Tasks {
    Serial,
    Parallel,
}

impl Tasks {
    /// Calls `work` on every item.
    pub fn run<I: Send>(self, items: Vec<I>, work: impl Fn(I) + Sync + Send) {
        match self {
            Self::Parallel if items.len() > 1 => {
                items.into_par_iter().with_max_len(1).for_each(work);
            }
            _ => items.into_iter().for_each(work),
        }
    }
}

/// Factors the panel `[L11; L21]` of a front in place, left-looking by a few slabs of columns;
/// `Err` is the pivot that failed.
///
/// Shapes: `panel` as `slabs` says, its lower triangle read.
pub(super) fn factor_panel<T: Real>(
    panel: &mut [T],
    slabs: Slabs,
    tasks: Tasks,
) -> Result<(), usize> {
    let arch = Arch::new();
    let mut inverses = vec![T::ZERO; FACTORED_SLABS * slabs.height];
    for first in (0..slabs.pivot_slabs()).step_by(FACTORED_SLABS) {
        let now = first..slabs.pivot_slabs().min(first + FACTORED_SLABS);
        let (top, below) = panel.split_at_mut(slabs.start(now.end));
        arch.dispatch(FactorTop { top, inverses: &mut inverses, slabs, now: now.clone() })?;
        let (top, inverses) = (&*top, &*inverses);
        let mut rows = rows_of(below, slabs, now.end..slabs.panel_slabs());
        tasks.run(rows.chunks_mut(TASK_SLABS).collect(), |rows| {
            arch.dispatch(FactorBelow { top, rows, inverses, slabs, now: now.clone() });
        });
    }
    Ok(())
}

/// The slabs of a part of a panel.
fn rows_of<T>(mut part: &mut [T], slabs: Slabs, range: Range<usize>) -> Vec<&mut [T]> {
    let mut rows = Vec::with_capacity(range.len());
    for slab in range {
        let (own, rest) = part.split_at_mut(slabs.width(slab) * slabs.height);
        rows.push(own);
        part = rest;
    }
    rows
}

/// The slabs of pivots that are factored now, one after another.
struct FactorTop<'a, T> {
    /// The panel up to the last of them.
    top: &'a mut [T],
    inverses: &'a mut [T],
    slabs: Slabs,
    now: Range<usize>,
}

impl<T: Real> WithSimd for FactorTop<'_, T> {
    type Output = Result<(), usize>;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> Result<(), usize> {
        let Self { top, inverses, slabs, now } = self;
        let (height, square) = (T::SLAB, T::SLAB * T::SLAB);
        for i in now.clone() {
            let (above, own) = top.split_at_mut(slabs.start(i));
            let (done, own) = own.split_at_mut(now.start * square);
            for s in now.start..=i {
                let columns = height.min(slabs.pivots - s * height);
                let (before, into) = own.split_at_mut((s - now.start) * square);
                let into = &mut into[..columns * height];
                let inverses = &mut inverses[(s - now.start) * height..][..columns];
                if s == i {
                    subtract_deep(simd, into, done, done, height, columns);
                    subtract_deep(simd, into, before, before, height, columns);
                    factor_square(simd, into, inverses, columns)
                        .map_err(|pivot| s * height + pivot)?;
                    continue;
                }
                let other = &above[slabs.start(s)..slabs.start(s + 1)];
                let (other_done, other) = other.split_at(now.start * square);
                subtract_deep(simd, into, done, other_done, height, columns);
                subtract_deep(simd, into, before, other, height, columns);
                let square = &other[(s - now.start) * square..];
                divide_by_square(simd, into, square, inverses, height, columns);
            }
        }
        Ok(())
    }
}

/// Slabs below those that are factored now.
struct FactorBelow<'a, 'b, T> {
    top: &'a [T],
    rows: &'a mut [&'b mut [T]],
    inverses: &'a [T],
    slabs: Slabs,
    now: Range<usize>,
}

impl<T: Real> WithSimd for FactorBelow<'_, '_, T> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { top, rows, inverses, slabs, now } = self;
        let (height, square) = (T::SLAB, T::SLAB * T::SLAB);
        let done_len = now.start * square;
        let columns_of = |s: usize| height.min(slabs.pivots - s * height);
        for from in (0..done_len).step_by(DEPTH * height) {
            let part = from..done_len.min(from + DEPTH * height);
            for s in now.clone() {
                let b = &top[slabs.start(s)..][part.clone()];
                for row in rows.iter_mut() {
                    let (done, into) = row.split_at_mut(done_len);
                    let into = &mut into[(s - now.start) * square..];
                    let b = Factors::Rows { strips: b, first: 0 };
                    let into = (into, Onto::There);
                    subtract_product(simd, into, &done[part.clone()], b, height, columns_of(s));
                }
            }
        }
        for row in rows {
            for s in now.clone() {
                let other = &top[slabs.start(s) + done_len..slabs.start(s + 1)];
                let at = (s - now.start) * square;
                let (before, into) = row[done_len..].split_at_mut(at);
                subtract_deep(simd, into, before, other, height, columns_of(s));
                let inverses = &inverses[(s - now.start) * height..];
                divide_by_square(simd, into, &other[at..], inverses, height, columns_of(s));
            }
        }
    }
}

/// `−L21 L21ᵀ` and the children's contributions into the contribution block; what was there is not
/// read.
///
/// Shapes: `panel` as `slabs` says; the block is that of the panel's rest.
pub(super) fn form_contribution<T: Real>(
    contribution: &mut Block<T>,
    panel: &[T],
    slabs: Slabs,
    children: &[Contribution<T>],
    tasks: Tasks,
) {
    let arch = Arch::new();
    let l21 = &panel[slabs.start(slabs.pivot_slabs())..];
    let mut tiles = tiles_of(contribution);
    // The tiles on the diagonal are half the work and come last.
    tiles.sort_by_key(|tile| tile.first == tile.columns.start);
    tasks.run(tiles, |tile| arch.dispatch(FormTile { l21, slabs, children, tile }));
}

/// A square of a contribution block.
struct Tile<'a, T> {
    /// First slab of its rows.
    first: usize,
    /// Slabs of its columns.
    columns: Range<usize>,
    /// Its part of each slab of rows.
    rows: Vec<&'a mut [T]>,
}

/// A contribution block in squares of a few slabs, which do not cross the cut between its pieces.
fn tiles_of<T: Real>(block: &mut Block<T>) -> Vec<Tile<'_, T>> {
    let Block { shape, eliminated, passed_on } = block;
    let square = shape.height * shape.height;
    let cut =
        (0..shape.cut).step_by(TILE_SLABS).chain((shape.cut..shape.slabs).step_by(TILE_SLABS));
    let starts: Vec<usize> = cut.chain([shape.slabs]).collect();
    let (mut eliminated, mut passed_on) = (&mut eliminated[..], &mut passed_on[..]);
    let mut tiles = Vec::new();
    for (group, rows) in starts.windows(2).enumerate() {
        let before = tiles.len();
        for columns in starts.windows(2).take(group + 1) {
            tiles.push(Tile { first: rows[0], columns: columns[0]..columns[1], rows: Vec::new() });
        }
        for row in rows[0]..rows[1] {
            for Tile { columns, rows, .. } in &mut tiles[before..] {
                let len = square * (columns.end.min(row + 1) - columns.start);
                let is_eliminated = columns.start < shape.cut;
                let piece = if is_eliminated { &mut eliminated } else { &mut passed_on };
                rows.push(piece.split_off_mut(..len).unwrap_or_default());
            }
        }
    }
    tiles
}

/// `−L21 L21ᵀ` and the children's contributions into one square.
struct FormTile<'a, 'b, T> {
    l21: &'a [T],
    slabs: Slabs,
    children: &'a [Contribution<T>],
    tile: Tile<'b, T>,
}

impl<T: Real> WithSimd for FormTile<'_, '_, T> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { l21, slabs, children, tile } = self;
        let Tile { first, columns, mut rows } = tile;
        let (height, square) = (T::SLAB, T::SLAB * T::SLAB);
        let whole = slabs.pivots * height;
        for from in (0..whole).step_by(DEPTH * height) {
            let to = whole.min(from + DEPTH * height);
            let onto = if from == 0 { Onto::Zero } else { Onto::There };
            for j in columns.clone() {
                for (i, row) in (first..).zip(rows.iter_mut()) {
                    let into = row.chunks_exact_mut(square).nth(j - columns.start);
                    let Some(into) = into else { continue };
                    let a = &l21[i * whole + from..i * whole + to];
                    let b = &l21[j * whole + from..j * whole + to];
                    let b = Factors::Rows { strips: b, first: 0 };
                    subtract_product(simd, (into, onto), a, b, height, height);
                }
            }
        }
        // The tile is in the nearest caches now.
        add_to_tile(simd, &mut rows, (first, &columns), slabs, children);
    }
}

#[cfg(test)]
mod tests {
    use super::super::blocks::Blocks;
    use super::super::slabs::BlockSlabs;
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

    /// The lower triangle of the first `pivots` columns in slabs.
    fn panel_of<T: Real>(whole: &[f64], slabs: Slabs) -> Vec<T> {
        let size = slabs.pivots + slabs.rest;
        let mut panel = vec![T::ZERO; slabs.panel_len()];
        for j in 0..slabs.pivots {
            for i in j..size {
                panel[slabs.panel_row(i) + j * slabs.height] = T::from_f64(whole[i + size * j]);
            }
        }
        panel
    }

    fn agrees_with_plain_elimination<T: Real>(
        (size, pivots, eliminated): (usize, usize, usize),
        good: f64,
    ) {
        let slabs = Slabs::new::<T>(pivots, size - pivots);
        let height = slabs.height;
        let whole = symmetric(size);
        let mut plain = whole.clone();
        eliminate(&mut plain, size, pivots);
        let mut first = None;
        for tasks in [Tasks::Serial, Tasks::Parallel] {
            let mut panel = panel_of::<T>(&whole, slabs);
            factor_panel(&mut panel, slabs, tasks).unwrap();
            let mut block =
                Blocks::new(usize::MAX).block(BlockSlabs::new::<T>(slabs.rest, eliminated));
            block.eliminated.fill(T::from_f64(f64::NAN));
            block.passed_on.fill(T::from_f64(f64::NAN));
            form_contribution(&mut block, &panel, slabs, &[], tasks);
            for j in 0..pivots {
                for i in j..size {
                    let found = panel[slabs.panel_row(i) + j * height].to_f64();
                    assert!((found - plain[i + size * j]).abs() < good, "({i}, {j}) of {size}");
                }
            }
            for j in 0..slabs.rest {
                for i in j..slabs.rest {
                    let at = i + pivots + size * (j + pivots);
                    let expected = plain[at] - whole[at];
                    let found = block.columns(i / height, j)[i % height];
                    assert!((found.to_f64() - expected).abs() < good, "({i}, {j}) of {size}");
                }
            }
            // Rows that fill up a slab stay zero: they are factors of products.
            let rows = slabs.start(slabs.pivot_slabs())..;
            let rest = slabs.rest % height;
            if rest > 0 {
                let last = &panel[rows][(slabs.rest_slabs() - 1) * pivots * height..];
                assert!(
                    last.chunks(height).all(|strip| strip[rest..].iter().all(|x| *x == T::ZERO))
                );
            }
            let numbers = panel.iter().chain(&block.eliminated[..]).chain(&block.passed_on[..]);
            let bits: Vec<u64> = numbers.map(|x| x.to_f64().to_bits()).collect();
            assert!(first.get_or_insert_with(|| bits.clone()) == &bits);
        }
    }

    #[test]
    fn panel_and_contribution_equal_plain_elimination_around_the_sizes_of_slabs() {
        let sizes = [
            (1, 1, 0),
            (5, 2, 3),
            (24, 24, 0),
            (25, 24, 1),
            (97, 96, 0),
            (130, 128, 2),
            (129, 129, 0),
            (400, 150, 100),
            (460, 7, 230),
            (460, 7, 453),
        ];
        for shape in sizes {
            agrees_with_plain_elimination::<f64>(shape, 1e-10);
            agrees_with_plain_elimination::<f32>(shape, 1e-2);
        }
    }

    #[test]
    fn failing_pivot_is_named_in_any_slab() {
        let slabs = Slabs::new::<f64>(210, 0);
        for pivot in [0, 3, 95, 96, 127, 200] {
            for bad in [-1.0e3, f64::NAN, f64::INFINITY] {
                let mut whole = symmetric(210);
                whole[pivot + 210 * pivot] = bad;
                let mut panel = panel_of::<f64>(&whole, slabs);
                assert_eq!(factor_panel(&mut panel, slabs, Tasks::Serial), Err(pivot));
            }
        }
    }
}
