//! The numerical factor: fronts filled, factored and handed up the tree.

use std::sync::Arc;

use rayon::prelude::*;

use super::Real;
use super::analysis::{Front, FrontAnalysis};
use super::assembly::{Contribution, add_entries, extend_add};
use super::dense::{Tasks, factor_panel, form_contribution};
use crate::fem::Stiffness;

/// Columns of a parallel front that one task fills.
const FILLED_COLUMNS: usize = 64;

/// Cholesky factor of `K11` as one dense panel per front.
///
/// Source: thesis (3.43a) asks for `K11⁻¹`; this stands for it.
pub struct FrontFactor<T> {
    pub(super) analysis: Arc<FrontAnalysis>,
    /// Panel of each front, size × pivots column-major.
    pub(super) panels: Vec<Vec<T>>,
}

/// Why there is no factor.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum FrontError {
    /// A pivot was not positive (or not a number).
    #[error("row {row} of K11 has no positive pivot")]
    NotPositive {
        /// Row of `K11`, in the partition's numbering.
        row: usize,
    },
    /// Memory could not be had.
    #[error("no memory for a factor of {bytes} bytes, contributions included")]
    OutOfMemory {
        /// Bytes asked for.
        bytes: usize,
    },
    /// The stiffness has another pattern than the analysis.
    #[error("the stiffness does not have the pattern that was analysed")]
    OtherPattern,
}

impl<T: Real> FrontFactor<T> {
    /// Factors `K11` on the current rayon pool; the bits do not depend on its size.
    ///
    /// # Errors
    /// [`FrontError`]; of several failing pivots the first in elimination order of the first
    /// failing subtree is named, always the same one.
    pub fn try_new(
        analysis: &Arc<FrontAnalysis>,
        stiffness: &Stiffness,
    ) -> Result<Self, FrontError> {
        let panels = analysis.fronts.iter().map(|_| Vec::new()).collect();
        let mut factor = Self { analysis: Arc::clone(analysis), panels };
        factor.refactor(stiffness)?;
        Ok(factor)
    }

    /// Factors again with other values on the same pattern, in the same memory.
    ///
    /// # Errors
    /// [`FrontError`]; the factor must not be used for solves after one.
    pub fn refactor(&mut self, stiffness: &Stiffness) -> Result<(), FrontError> {
        if !self.analysis.fits(stiffness) {
            return Err(FrontError::OtherPattern);
        }
        probe_memory(self.analysis.peak_bytes::<T>())?;
        let run = Run { analysis: &self.analysis, stiffness };
        run.subtrees(&self.analysis.roots, 0, &mut self.panels).map(drop)
    }

    /// Bytes of the panels.
    pub fn bytes(&self) -> usize {
        self.panels.iter().map(|panel| size_of_val(panel.as_slice())).sum()
    }

    /// The analysis this factor follows.
    pub fn analysis(&self) -> &Arc<FrontAnalysis> {
        &self.analysis
    }
}

/// One factorisation under way.
struct Run<'a> {
    analysis: &'a FrontAnalysis,
    stiffness: &'a Stiffness,
}

impl Run<'_> {
    /// Factors sibling subtrees as tasks; returns their contribution blocks.
    ///
    /// `panels` starts at front `first` and ends with the last of the subtrees.
    fn subtrees<T: Real>(
        &self,
        heads: &[u32],
        first: usize,
        panels: &mut [Vec<T>],
    ) -> Result<Vec<Vec<T>>, FrontError> {
        let mut rest = panels;
        let mut start = first;
        let mut tasks = Vec::with_capacity(heads.len());
        for &head in heads {
            let (own, tail) = rest.split_at_mut(head as usize + 1 - start);
            tasks.push((head as usize, own));
            start = head as usize + 1;
            rest = tail;
        }
        // Every subtree is finished before an error is looked at, so that it is always the same.
        let done: Vec<Result<Vec<T>, FrontError>> =
            tasks.into_par_iter().map(|(head, panels)| self.subtree(head, panels)).collect();
        done.into_iter().collect()
    }

    /// Factors one subtree; returns the contribution block of its head.
    fn subtree<T: Real>(&self, head: usize, panels: &mut [Vec<T>]) -> Result<Vec<T>, FrontError> {
        let fronts = &self.analysis.fronts;
        if fronts[head].is_serial() {
            return self.serial(head, panels);
        }
        // A chain of only children is a loop, not a recursion: it can be long.
        let mut bottom = head;
        while let [only] = fronts[bottom].children[..]
            && !fronts[only as usize].is_serial()
        {
            bottom = only as usize;
        }
        let first = fronts[head].subtree_first as usize;
        let (below, chain) = panels.split_at_mut(bottom - first);
        let mut blocks = self.subtrees(&fronts[bottom].children, first, below)?;
        for (v, panel) in (bottom..=head).zip(chain) {
            let front = &fronts[v];
            let children: Vec<Contribution<'_, T>> = front
                .children
                .iter()
                .zip(&blocks)
                .map(|(&c, values)| self.contribution(c, values))
                .collect();
            let mut block = vec![T::ZERO; front.rest() * front.rest()];
            self.front(v, panel, &mut block, &children, Tasks::Parallel)?;
            blocks = vec![block];
        }
        Ok(blocks.pop().unwrap_or_default())
    }

    /// Factors a subtree front by front, with the contribution blocks in one arena.
    fn serial<T: Real>(&self, head: usize, panels: &mut [Vec<T>]) -> Result<Vec<T>, FrontError> {
        let fronts = &self.analysis.fronts;
        let first = fronts[head].subtree_first as usize;
        let mut arena = vec![T::ZERO; fronts[head].arena];
        for (v, panel) in (first..=head).zip(panels) {
            let front = &fronts[v];
            let block_len = front.rest() * front.rest();
            // The children lie on the other of the arena's two stacks, all on one side.
            let leftmost = front.children.iter().map(|&c| fronts[c as usize].in_arena).min();
            let (block, others, others_at) = match leftmost {
                Some(at) if at < front.in_arena => {
                    let (others, own) = arena.split_at_mut(front.in_arena);
                    (&mut own[..block_len], others, 0)
                }
                _ => {
                    let end = front.in_arena + block_len;
                    let (own, others) = arena.split_at_mut(end);
                    (&mut own[front.in_arena..], others, end)
                }
            };
            let children: Vec<Contribution<'_, T>> = front
                .children
                .iter()
                .map(|&c| self.contribution(c, &others[fronts[c as usize].in_arena - others_at..]))
                .collect();
            self.front(v, panel, block, &children, Tasks::Serial)?;
        }
        arena.truncate(fronts[head].rest() * fronts[head].rest());
        arena.shrink_to_fit();
        Ok(arena)
    }

    fn contribution<'b, T>(&'b self, child: u32, values: &'b [T]) -> Contribution<'b, T> {
        let child = &self.analysis.fronts[child as usize];
        Contribution { runs: &child.runs, values, rest: child.rest() }
    }

    /// Fills and factors one front and forms its contribution block.
    fn front<T: Real>(
        &self,
        v: usize,
        panel: &mut Vec<T>,
        block: &mut [T],
        children: &[Contribution<'_, T>],
        tasks: Tasks,
    ) -> Result<(), FrontError> {
        let front = &self.analysis.fronts[v];
        let (size, pivots) = (front.size, front.pivots);
        reset(panel, front.panel_len());
        add_entries(panel, front, &self.analysis.entries, self.stiffness);
        add_children(panel, 0..pivots, 0, size, children, tasks);
        factor_panel(panel, size, pivots, tasks)
            .map_err(|pivot| self.not_positive(front, pivot))?;
        form_contribution(block, panel, size, pivots, tasks);
        add_children(block, pivots..size, pivots, size, children, tasks);
        Ok(())
    }

    fn not_positive(&self, front: &Front, pivot: usize) -> FrontError {
        FrontError::NotPositive { row: self.analysis.order[front.first + pivot] as usize }
    }
}

/// Adds all children's contributions to the columns `columns` of a front, in the children's order.
fn add_children<T: Real>(
    into: &mut [T],
    columns: std::ops::Range<usize>,
    first_row: usize,
    size: usize,
    children: &[Contribution<'_, T>],
    tasks: Tasks,
) {
    match tasks {
        Tasks::Serial => {
            for child in children {
                extend_add(into, columns.clone(), first_row, size, child);
            }
        }
        Tasks::Parallel => {
            let height = size - first_row;
            if height == 0 {
                return;
            }
            into.par_chunks_mut(FILLED_COLUMNS * height).enumerate().for_each(|(k, into)| {
                let from = columns.start + k * FILLED_COLUMNS;
                let some = from..(from + FILLED_COLUMNS).min(columns.end);
                for child in children {
                    extend_add(into, some.clone(), first_row, size, child);
                }
            });
        }
    }
}

/// Refuses a request the system would refuse, before it is made piece by piece.
///
/// The pieces themselves are zeroed by the system when they are first touched, by the thread that
/// works on them; only the infallible constructors offer that.
fn probe_memory(bytes: usize) -> Result<(), FrontError> {
    Vec::<u8>::new().try_reserve_exact(bytes).map_err(|_| FrontError::OutOfMemory { bytes })
}

/// Makes `values` hold `len` zeros, in the memory it has if that fits.
fn reset<T: Real>(values: &mut Vec<T>, len: usize) {
    match values.len() == len {
        true => values.fill(T::ZERO),
        false => *values = vec![T::ZERO; len],
    }
}
