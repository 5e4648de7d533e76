//! How a front lies in memory: slabs of a few rows, each column of a slab in one piece.
//!
//! ```text
//! panel                       contribution block
//! slab 0   ┌─┐                ┌─┐
//! slab 1   │ └─┐              │ └─┐
//! slab 2   │   └┐ pivots      │   └─┐
//!          ├────┤             └─────┘
//! slab 3   │    │ rest
//! slab 4   └────┘
//! ```
//!
//! The kernels read a slab from its first column to its last without a step, for both sides of a
//! product, so nothing is packed; and what lies above the diagonal is stored inside the squares on
//! it only.

use super::Real;

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

    /// Where a slab of the contribution block begins.
    pub fn block_start(self, slab: usize) -> usize {
        slab * (slab + 1) / 2 * self.height.pow(2)
    }

    /// Numbers of the contribution block.
    pub fn block_len(self) -> usize {
        self.block_start(self.rest_slabs())
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
            let mut seen = vec![false; slabs.block_len()];
            for row in 0..rest {
                for column in 0..=row {
                    let at = slabs.block_start(row / slabs.height)
                        + column * slabs.height
                        + row % slabs.height;
                    assert!(!std::mem::replace(&mut seen[at], true), "({row}, {column})");
                }
            }
        }
    }
}
