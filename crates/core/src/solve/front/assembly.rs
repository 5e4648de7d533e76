//! Filling a front: entries of the stiffness, then the children's contributions in their order.

use std::ops::Range;

use super::Real;
use super::analysis::{Entries, Front, Run};
use crate::fem::{AXES, Stiffness};

/// A child's contribution block on its way into the parent's front.
///
/// Shapes: `values` rest × rest column-major, lower triangle.
pub(super) struct Contribution<'a, T> {
    pub runs: &'a [Run],
    pub values: &'a [T],
    pub rest: usize,
}

/// All axes of a node unknown.
const ALL_AXES: u8 = 0b111;

/// Writes the stiffness entries of a front's pivots into its zeroed panel.
///
/// Source: thesis (3.41): `K11` is what is left of the stiffness.
pub(super) fn add_entries<T: Real>(
    panel: &mut [T],
    front: &Front,
    entries: &Entries,
    stiffness: &Stiffness,
) {
    let mut column = 0;
    for vertex in front.vertices.start as usize..front.vertices.end as usize {
        let axes = entries.axes[vertex];
        for (row, row_axes, block) in entries.of(vertex, stiffness) {
            // Block (vertex, other), row-major; the panel holds its transpose.
            if axes == ALL_AXES && row_axes == ALL_AXES {
                for c in 0..AXES {
                    let at = (column + c) * front.size + row;
                    for (a, slot) in panel[at..at + AXES].iter_mut().enumerate() {
                        *slot = T::from_f64(block[AXES * c + a]);
                    }
                }
                continue;
            }
            let unknown = |mask: u8| (0..AXES).filter(move |&a| mask & (1 << a) != 0);
            for (j, c) in unknown(axes).enumerate() {
                for (i, a) in unknown(row_axes).enumerate() {
                    panel[(column + j) * front.size + row + i] = T::from_f64(block[AXES * c + a]);
                }
            }
        }
        column += axes.count_ones() as usize;
    }
}

/// Adds a child's contribution to some columns of the parent's front.
///
/// Shapes: `into` holds the parent's columns `columns`, each with its rows `first_row .. size`.
pub(super) fn extend_add<T: Real>(
    into: &mut [T],
    columns: Range<usize>,
    first_row: usize,
    size: usize,
    child: &Contribution<'_, T>,
) {
    let height = size - first_row;
    for (position, run) in child.runs.iter().enumerate() {
        let (parent, len) = (run.parent as usize, run.len as usize);
        let from = columns.start.clamp(parent, parent + len) - parent;
        let to = columns.end.clamp(parent, parent + len) - parent;
        for j in from..to {
            let source_column = run.child as usize + j;
            let source = &child.values[source_column * child.rest..][..child.rest];
            let into = &mut into[(parent + j - columns.start) * height..][..height];
            add_slice(
                &mut into[parent + j - first_row..parent + len - first_row],
                &source[source_column..run.child as usize + len],
            );
            for below in &child.runs[position + 1..] {
                let (row, len) = (below.parent as usize - first_row, below.len as usize);
                let source = &source[below.child as usize..][..len];
                add_slice(&mut into[row..][..len], source);
            }
        }
    }
}

#[inline]
fn add_slice<T: Real>(into: &mut [T], values: &[T]) {
    for (slot, &value) in into.iter_mut().zip(values) {
        *slot += value;
    }
}
