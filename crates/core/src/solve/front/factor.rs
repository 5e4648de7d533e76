//! The numerical factor: fronts filled, factored and handed up the tree.

use std::sync::Arc;

use pulp::Arch;
use rayon::prelude::*;

use super::Real;
use super::analysis::{Front, FrontAnalysis};
use super::assembly::{AddToPanel, Contribution, add_entries};
use super::blocks::{Block, Blocks};
use super::dense::{TASK_SLABS, Tasks, factor_panel, form_contribution};
use super::lines::Lines;
use super::slabs::Slabs;
use crate::fem::Stiffness;

/// Cholesky factor of `K11` as one dense panel per front.
///
/// Source: thesis (3.43a) asks for `K11⁻¹`; this stands for it.
pub struct FrontFactor<T> {
    pub(super) analysis: Arc<FrontAnalysis>,
    /// Panel of each front, in slabs; empty before the first factor.
    pub(super) panels: Vec<Lines<T>>,
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
        let panels = analysis.fronts.iter().map(|_| Lines::default()).collect();
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
        // Panels that are not there yet count as their fronts are come to.
        let limit = match self.panels.iter().all(|panel| panel.is_empty()) {
            true => self.analysis.peak::<T>(),
            false => self.analysis.blocks_max::<T>(),
        };
        probe_memory(limit * size_of::<T>())?;
        let blocks = Blocks::new(limit);
        let run = Run { analysis: &self.analysis, stiffness, blocks };
        run.subtrees(&self.analysis.roots, 0, &mut self.panels).map(drop)
    }

    /// Bytes of the panels.
    pub fn bytes(&self) -> usize {
        self.panels.iter().map(|panel| size_of_val::<[T]>(panel)).sum()
    }

    /// The analysis this factor follows.
    pub fn analysis(&self) -> &Arc<FrontAnalysis> {
        &self.analysis
    }
}

/// One factorisation under way.
struct Run<'a, T> {
    analysis: &'a FrontAnalysis,
    stiffness: &'a Stiffness,
    blocks: Blocks<T>,
}

impl<T: Real> Run<'_, T> {
    /// Factors sibling subtrees as tasks; returns their contribution blocks.
    ///
    /// `panels` starts at front `first` and ends with the last of the subtrees.
    fn subtrees(
        &self,
        heads: &[u32],
        first: usize,
        panels: &mut [Lines<T>],
    ) -> Result<Vec<Block<T>>, FrontError> {
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
        let done: Vec<Result<Block<T>, FrontError>> =
            tasks.into_par_iter().map(|(head, panels)| self.subtree(head, panels)).collect();
        done.into_iter().collect()
    }

    /// Factors one subtree; returns the contribution block of its head.
    fn subtree(&self, head: usize, panels: &mut [Lines<T>]) -> Result<Block<T>, FrontError> {
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
        let mut children = self.subtrees(&fronts[bottom].children, first, below)?;
        for (v, panel) in (bottom..=head).zip(chain) {
            children = vec![self.front(v, panel, children, Tasks::Parallel)?];
        }
        Ok(children.pop().unwrap_or_default())
    }

    /// Factors a subtree front by front.
    fn serial(&self, head: usize, panels: &mut [Lines<T>]) -> Result<Block<T>, FrontError> {
        let fronts = &self.analysis.fronts;
        let first = fronts[head].subtree_first as usize;
        let mut waiting: Vec<Block<T>> = Vec::new();
        for (v, panel) in (first..=head).zip(panels) {
            let children = waiting.split_off(waiting.len() - fronts[v].children.len());
            waiting.push(self.front(v, panel, children, Tasks::Serial)?);
        }
        Ok(waiting.pop().unwrap_or_default())
    }

    /// Fills and factors one front; returns its contribution block.
    fn front(
        &self,
        v: usize,
        panel: &mut Lines<T>,
        handed: Vec<Block<T>>,
        tasks: Tasks,
    ) -> Result<Block<T>, FrontError> {
        let front = &self.analysis.fronts[v];
        let slabs = front.slabs::<T>();
        // What the system hands out is zero.
        let is_clear = panel.is_empty();
        if is_clear {
            *panel = self.blocks.keep(slabs.panel_len());
        }
        let runs = |child: u32| &self.analysis.fronts[child as usize].runs;
        let handed = front.children.iter().zip(handed);
        let mut children: Vec<Contribution<T>> =
            handed.map(|(&child, block)| Contribution::new(block, runs(child), slabs)).collect();
        fill_panel((&mut *panel, is_clear), slabs, &children, tasks);
        for child in &mut children {
            self.blocks.give_back(std::mem::take(&mut child.block.eliminated));
        }
        add_entries(panel, front, slabs, &self.analysis.entries, self.stiffness);
        factor_panel(panel, slabs, tasks).map_err(|pivot| self.not_positive(front, pivot))?;
        let mut own = self.blocks.block(front.block_slabs::<T>());
        form_contribution(&mut own, panel, slabs, &children, tasks);
        children.into_iter().for_each(|child| self.blocks.give_back(child.block.passed_on));
        Ok(own)
    }

    fn not_positive(&self, front: &Front, pivot: usize) -> FrontError {
        FrontError::NotPositive { row: self.analysis.order[front.first + pivot] as usize }
    }
}

/// Clears a panel that is not clear, and adds the children's contributions, some slabs a task.
fn fill_panel<T: Real>(
    (panel, is_clear): (&mut [T], bool),
    slabs: Slabs,
    children: &[Contribution<T>],
    tasks: Tasks,
) {
    let mut parts = Vec::with_capacity(slabs.panel_slabs().div_ceil(TASK_SLABS));
    let mut rest = panel;
    for first in (0..slabs.panel_slabs()).step_by(TASK_SLABS) {
        let range = first..slabs.panel_slabs().min(first + TASK_SLABS);
        let (part, after) = rest.split_at_mut(slabs.start(range.end) - slabs.start(first));
        parts.push((part, range));
        rest = after;
    }
    tasks.run(parts, |(panel, range)| {
        if !is_clear {
            panel.fill(T::ZERO);
        }
        Arch::new().dispatch(AddToPanel { panel, range, slabs, children });
    });
}

/// Refuses a request the system would refuse, before it is made piece by piece.
///
/// The pieces themselves are zeroed by the system when they are first touched, by the thread that
/// works on them; only the infallible constructors offer that.
fn probe_memory(bytes: usize) -> Result<(), FrontError> {
    Vec::<u8>::new().try_reserve_exact(bytes).map_err(|_| FrontError::OutOfMemory { bytes })
}
