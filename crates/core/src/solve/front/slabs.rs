//! How a front lies in memory: slabs of a few rows, each column of a slab in one piece.
//!
//! ```text
//! panel                       contribution block
//! slab 0   ┌─┐                ┌─┐             columns that the parent
//! slab 1   │ └─┐              │ └─┐           ↙ eliminates
//! slab 2   │   └┐ pivots      │   ├─┐           ↙ passes on
//!          ├────┤             │   │ └─┐
//! slab 3   │    │ rest        └───┴───┘
//! slab 4   └────┘
//! ```
//!
//! The kernels read a slab from its first column to its last without a step, for both sides of a
//! product, so nothing is packed; and what lies above the diagonal is stored inside the squares on
//! it only. A contribution block is two pieces of memory: the columns that the parent eliminates are
//! needed until its panel is filled, the others until its own contribution block is formed.

use std::marker::PhantomData;
use std::ops::{Deref, DerefMut};

use bytemuck::{Pod, Zeroable};

use super::Real;

/// One cache line, and one vector of 512 bits.
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C, align(64))]
struct Line([f64; 8]);

/// A list of numbers that begins where a cache line does.
///
/// Shapes: it holds at least as many as were asked for, rounded up to whole lines.
pub struct Lines<T> {
    lines: Vec<Line>,
    numbers: PhantomData<T>,
}

impl<T> Default for Lines<T> {
    fn default() -> Self {
        Self { lines: Vec::new(), numbers: PhantomData }
    }
}

impl<T: Real> Lines<T> {
    /// Zeros; the system clears the memory when it is first touched.
    pub fn zeros(len: usize) -> Self {
        Self { lines: bytemuck::zeroed_vec(count::<T>(len)), numbers: PhantomData }
    }

    /// Gives the memory behind so many numbers back to the system.
    pub fn shorten(&mut self, len: usize) {
        self.lines.truncate(count::<T>(len));
        self.lines.shrink_to_fit();
    }
}

/// Lines that so many numbers take.
fn count<T>(len: usize) -> usize {
    (len * size_of::<T>()).div_ceil(size_of::<Line>())
}

impl<T: Real> Deref for Lines<T> {
    type Target = [T];

    fn deref(&self) -> &[T] {
        bytemuck::cast_slice(&self.lines)
    }
}

impl<T: Real> DerefMut for Lines<T> {
    fn deref_mut(&mut self) -> &mut [T] {
        bytemuck::cast_slice_mut(&mut self.lines)
    }
}

/// Shape of one front.
///
/// Shapes: pivots and rest begin with a slab each; rows that fill up the last slab are zero.
#[derive(Clone, Copy, Debug)]
pub(super) struct Slabs {
    /// Rows of a slab.
    pub height: usize,
    pub pivots: usize,
    pub rest: usize,
}

impl Slabs {
    pub fn new<T: Real>(pivots: usize, rest: usize) -> Self {
        Self { height: T::SLAB, pivots, rest }
    }

    /// Slabs of the pivots' rows.
    pub fn pivot_slabs(self) -> usize {
        self.pivots.div_ceil(self.height)
    }

    /// Slabs of the other rows.
    pub fn rest_slabs(self) -> usize {
        self.rest.div_ceil(self.height)
    }

    /// Slabs of the panel.
    pub fn panel_slabs(self) -> usize {
        self.pivot_slabs() + self.rest_slabs()
    }

    /// Columns of a slab of the panel.
    pub fn width(self, slab: usize) -> usize {
        self.pivots.min((slab + 1) * self.height)
    }

    /// Where a slab of the panel begins.
    pub fn start(self, slab: usize) -> usize {
        match slab.checked_sub(self.pivot_slabs()) {
            None => slab * (slab + 1) / 2 * self.height.pow(2),
            Some(below) => {
                let whole = self.pivot_slabs().saturating_sub(1);
                let triangle = whole * (whole + 1) / 2 * self.height.pow(2);
                let last = if self.pivots > 0 { self.pivots * self.height } else { 0 };
                triangle + last + below * self.pivots * self.height
            }
        }
    }

    /// Numbers of the panel.
    pub fn panel_len(self) -> usize {
        self.start(self.panel_slabs())
    }

    /// Row of the front, counted with the zero rows between pivots and rest.
    pub fn padded(self, row: usize) -> usize {
        match row.checked_sub(self.pivots) {
            None => row,
            Some(below) => self.pivot_slabs() * self.height + below,
        }
    }

    /// Rows with those that are zero.
    pub fn padded_rows(self) -> usize {
        self.panel_slabs() * self.height
    }

    /// Where the first number of a row of the panel lies; its columns follow every `height`.
    pub fn panel_row(self, row: usize) -> usize {
        let padded = self.padded(row);
        self.start(padded / self.height) + padded % self.height
    }
}

/// Shape of a front's contribution block.
///
/// Shapes: `slabs` slabs of rows, each with the columns up to its square on the diagonal; the
/// columns of the first `cut` slabs are those that the parent eliminates.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct BlockSlabs {
    /// Rows of a slab.
    pub height: usize,
    pub slabs: usize,
    pub cut: usize,
}

impl BlockSlabs {
    /// Shapes: `rest` rows, of which the parent eliminates the first `eliminated`; those that fill
    /// no slab of their own count as passed on.
    pub fn new<T: Real>(rest: usize, eliminated: usize) -> Self {
        Self { height: T::SLAB, slabs: rest.div_ceil(T::SLAB), cut: eliminated / T::SLAB }
    }

    /// Where a slab begins among the columns that the parent eliminates.
    pub fn eliminated_start(self, slab: usize) -> usize {
        let (triangle, below) = (slab.min(self.cut), slab.saturating_sub(self.cut));
        (triangle * (triangle + 1) / 2 + below * self.cut) * self.height.pow(2)
    }

    /// Where a slab begins among the columns that the parent passes on.
    pub fn passed_on_start(self, slab: usize) -> usize {
        let slab = slab.saturating_sub(self.cut);
        slab * (slab + 1) / 2 * self.height.pow(2)
    }

    /// Numbers of the columns that the parent eliminates.
    pub fn eliminated_len(self) -> usize {
        self.eliminated_start(self.slabs)
    }

    /// Numbers of the columns that the parent passes on.
    pub fn passed_on_len(self) -> usize {
        self.passed_on_start(self.slabs)
    }

    /// Numbers of both.
    pub fn len(self) -> usize {
        self.eliminated_len() + self.passed_on_len()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_entry_of_a_front_has_a_place_of_its_own() {
        for (pivots, rest) in [(1, 0), (1, 1), (23, 25), (24, 24), (25, 0), (49, 73), (72, 1)] {
            let slabs = Slabs::new::<f64>(pivots, rest);
            let mut seen = vec![false; slabs.panel_len()];
            for row in 0..pivots + rest {
                for column in 0..pivots.min(row + 1) {
                    let at = slabs.panel_row(row) + column * slabs.height;
                    assert!(!std::mem::replace(&mut seen[at], true), "({row}, {column})");
                }
            }
        }
    }

    #[test]
    fn every_entry_of_a_contribution_block_has_a_place_of_its_own() {
        for (rest, eliminated) in [(1, 0), (1, 1), (24, 24), (25, 24), (97, 30), (97, 73), (97, 97)]
        {
            let block = BlockSlabs::new::<f64>(rest, eliminated);
            let mut seen =
                [vec![false; block.eliminated_len()], vec![false; block.passed_on_len()]];
            for row in 0..rest {
                let (slab, row) = (row / block.height, row % block.height);
                for column in 0..=slab * block.height + row {
                    let at = match column.checked_sub(block.cut * block.height) {
                        None => block.eliminated_start(slab) + column * block.height,
                        Some(column) => block.passed_on_start(slab) + column * block.height,
                    };
                    let seen = &mut seen[usize::from(column >= block.cut * block.height)];
                    assert!(!std::mem::replace(&mut seen[at + row], true), "({row}, {column})");
                }
            }
        }
    }
}
