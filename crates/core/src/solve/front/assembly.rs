//! Filling a front: the children's contributions in their order, then entries of the stiffness.

use std::ops::Range;

use pulp::{Simd, WithSimd};

use super::Real;
use super::analysis::{Entries, Front, Run};
use super::blocks::Block;
use super::slabs::Slabs;
use crate::fem::{AXES, Stiffness};

/// A child's contribution block on its way into the parent's front.
pub(super) struct Contribution<T> {
    pub block: Block<T>,
    pieces: Vec<Piece>,
    /// Pieces whose rows are pivots of the parent come first; this many.
    to_pivots: usize,
}

/// Rows that lie in one slab of the child and in one of the parent.
struct Piece {
    child: usize,
    parent: usize,
    len: usize,
}

impl<T: Real> Contribution<T> {
    /// Shapes: `parent` the shape of the front it goes into.
    pub fn new(block: Block<T>, runs: &[Run], parent: Slabs) -> Self {
        let height = parent.height;
        let mut pieces = Vec::with_capacity(2 * runs.len());
        for run in runs {
            let mut done = 0;
            while done < run.len as usize {
                let (child, row) = (run.child as usize + done, run.parent as usize + done);
                let len = (run.len as usize - done)
                    .min(height - child % height)
                    .min(height - parent.padded(row) % height);
                pieces.push(Piece { child, parent: row, len });
                done += len;
            }
        }
        let to_pivots = pieces.partition_point(|piece| piece.parent < parent.pivots);
        Self { block, pieces, to_pivots }
    }
}

/// Adds all children's contributions to some slabs of a panel, in the children's order.
pub(super) struct AddToPanel<'a, T> {
    pub panel: &'a mut [T],
    pub range: Range<usize>,
    pub slabs: Slabs,
    pub children: &'a [Contribution<T>],
}

impl<T: Real> WithSimd for AddToPanel<'_, T> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { panel, range, slabs, children } = self;
        let (start, height) = (slabs.start(range.start), slabs.height);
        for child in children {
            let slab_of = |piece: &Piece| slabs.padded(piece.parent) / height;
            let rows = child.pieces.partition_point(|piece| slab_of(piece) < range.start)
                ..child.pieces.partition_point(|piece| slab_of(piece) < range.end);
            for k in rows {
                let row = &child.pieces[k];
                let into = &mut panel[slabs.panel_row(row.parent) - start..];
                let columns = &child.pieces[..child.to_pivots.min(k + 1)];
                add_row(simd, into, &child.block, row, columns, 0);
            }
        }
    }
}

/// Adds all children's contributions to a square of the contribution block, in their order.
///
/// Shapes: `rows` the square's part of each slab, the first one slab `row`; its columns are those of
/// the slabs `columns`.
#[inline(always)]
pub(super) fn add_to_tile<S: Simd, T: Real>(
    simd: S,
    rows: &mut [&mut [T]],
    (row, columns): (usize, &Range<usize>),
    slabs: Slabs,
    children: &[Contribution<T>],
) {
    let height = slabs.height;
    for child in children {
        let pieces = &child.pieces[child.to_pivots..];
        let slab_of = |piece: &Piece| (piece.parent - slabs.pivots) / height;
        let before = |slab: usize| pieces.partition_point(|piece| slab_of(piece) < slab);
        let tile = before(columns.start)..before(columns.end);
        for k in before(row)..before(row + rows.len()) {
            let piece = &pieces[k];
            let into = &mut rows[slab_of(piece) - row][(piece.parent - slabs.pivots) % height..];
            let own = &pieces[tile.start..tile.end.min(k + 1)];
            add_row(simd, into, &child.block, piece, own, slabs.pivots + columns.start * height);
        }
    }
}

/// Adds the rows of one piece, the columns of those before it and its own lower triangle.
///
/// Shapes: `into` begins with the piece's first row, its columns follow every `height`; the first
/// column there is the parent's row `first`.
#[inline(always)]
fn add_row<S: Simd, T: Real>(
    simd: S,
    into: &mut [T],
    block: &Block<T>,
    row: &Piece,
    columns: &[Piece],
    first: usize,
) {
    let height = block.shape.height;
    for column in columns {
        let is_own = column.child == row.child;
        let values = &block.columns(row.child / height, column.child)[row.child % height..];
        for j in 0..column.len {
            let top = if is_own { j } else { 0 };
            let from = &values[j * height..][top..row.len];
            let into = &mut into[(column.parent - first + j) * height..][top..row.len];
            T::add_onto(simd, into, from);
        }
    }
}

/// All axes of a node unknown.
const ALL_AXES: u8 = 0b111;

/// Adds the stiffness entries of a front's pivots to its panel.
///
/// Source: thesis (3.41): `K11` is what is left of the stiffness.
pub(super) fn add_entries<T: Real>(
    panel: &mut [T],
    front: &Front,
    slabs: Slabs,
    entries: &Entries,
    stiffness: &Stiffness,
) {
    let unknown = |mask: u8| (0..AXES).filter(move |&a| mask & (1 << a) != 0);
    let mut column = 0;
    for vertex in front.vertices.start as usize..front.vertices.end as usize {
        let axes = entries.axes[vertex];
        for (row, row_axes, block) in entries.of(vertex, stiffness) {
            // Block (vertex, other), row-major; the panel holds its transpose.
            let at = slabs.panel_row(row);
            let is_whole = axes == ALL_AXES && row_axes == ALL_AXES;
            if is_whole && row > column && slabs.panel_row(row + AXES - 1) == at + AXES - 1 {
                for c in 0..AXES {
                    let into = &mut panel[at + (column + c) * slabs.height..][..AXES];
                    for (a, slot) in into.iter_mut().enumerate() {
                        *slot += T::from_f64(block[AXES * c + a]);
                    }
                }
                continue;
            }
            for (i, a) in unknown(row_axes).enumerate() {
                let at = slabs.panel_row(row + i);
                for (j, c) in unknown(axes).enumerate().filter(|&(j, _)| column + j <= row + i) {
                    panel[at + (column + j) * slabs.height] += T::from_f64(block[AXES * c + a]);
                }
            }
        }
        column += axes.count_ones() as usize;
    }
}
