//! The numerical factor: fronts filled, factored and handed up the tree; and solves with it.

use std::sync::Arc;

use faer::{Mat, MatMut};
use pulp::Arch;
use rayon::prelude::*;

use super::Real;
use super::analysis::{Front, FrontAnalysis};
use super::assembly::{AddToPanel, Contribution, add_entries};
use super::blocks::{Block, Blocks};
use super::dense::{TASK_SLABS, Tasks, factor_panel, form_contribution};
use super::slabs::{Lines, Slabs};
use super::solve::{Paths, solve_ordered};
use super::substitute::width;
use crate::fem::Stiffness;
use crate::solve::Partition;

/// Cholesky factor of `K11` as one dense panel per front.
///
/// Source: thesis (3.43a) asks for `K11⁻¹`; this stands for it.
pub struct FrontFactor<T> {
    analysis: Arc<FrontAnalysis>,
    /// Panel of each front, in slabs; empty before the first factor.
    pub(super) panels: Vec<Lines<T>>,
}

/// Rows that a task takes into the order of elimination or out of it.
const TASK_ROWS: usize = 256;

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

impl<T: FrontPrecision> FrontFactor<T> {
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
        T::factor((&self.analysis, &mut self.panels), stiffness, limit)
    }

    /// Bytes of the panels.
    pub fn bytes(&self) -> usize {
        self.panels.iter().map(|panel| size_of_val::<[T]>(panel)).sum()
    }

    /// The analysis this factor follows.
    pub fn analysis(&self) -> &Arc<FrontAnalysis> {
        &self.analysis
    }

    /// Solves `K11 X = B` in place on the current rayon pool; same bits for any number of threads.
    ///
    /// Shapes: `b` n × `columns` column-major. An `f32` factor rounds on the way in and answers
    /// to about seven digits; refine with the residual in `f64`.
    ///
    /// # Panics
    /// If `b` does not hold n × `columns` numbers.
    ///
    /// Source: thesis (3.43a).
    pub fn solve_in_place(&self, b: &mut [f64], columns: usize) {
        let n = self.analysis.row_count();
        assert_eq!(b.len(), n * columns, "right-hand sides do not fit the factor");
        if b.is_empty() {
            return;
        }
        let all = Paths::all(&self.analysis);
        // As many at once as fit into the strips of the kernels.
        for b in b.chunks_mut(n * T::SLAB) {
            let columns = b.len() / n;
            let mut x = self.strips(columns, |row, j| b[j * n + row]);
            self.solve_ordered(&mut x, width::<T>(columns), &all);
            self.each_number(&x, columns, |row, j, x| b[j * n + row] = x);
        }
    }

    /// Solves `K11 X = B` for the unknown rows of B with the numbers of one row next to each other; X
    /// is zero on the other rows.
    ///
    /// Shapes: `b` and `x` 3N × columns row-major; `scales` one number for each column, which it is
    /// divided by on the way through the factor; `partition` the one that was analysed.
    ///
    /// # Panics
    /// If the partition has other rows than the factor, or `b` and `x` do not fit it.
    pub fn solve_rows(&self, (b, x): (&[f64], &mut [f64]), scales: &[f64], partition: &Partition) {
        let (analysis, columns) = (&*self.analysis, scales.len());
        assert_eq!(analysis.row_count(), partition.unknown().len(), "the factor has other rows");
        assert_eq!((b.len(), x.len()), (partition.dof_count() * columns, b.len()), "other rows");
        let all = Paths::all(analysis);
        for first in (0..columns).step_by(T::SLAB) {
            let some = first..columns.min(first + T::SLAB);
            let width = width::<T>(some.len());
            let by: Vec<f64> = scales[some.clone()].iter().map(|scale| scale.recip()).collect();
            let mut strips = Lines::<T>::zeros(analysis.row_count() * width);
            let rows = analysis.order.par_chunks(TASK_ROWS);
            strips.par_chunks_mut(TASK_ROWS * width).zip(rows).for_each(|(strips, rows)| {
                for (strip, &row) in strips.chunks_exact_mut(width).zip(rows) {
                    let b =
                        &b[partition.unknown()[row as usize] as usize * columns..][some.clone()];
                    let scaled = b.iter().zip(&by).map(|(b, by)| T::from_f64(b * by));
                    strip.iter_mut().zip(scaled).for_each(|(strip, b)| *strip = b);
                }
            });
            self.solve_ordered(&mut strips, width, &all);
            x.par_chunks_mut(TASK_ROWS * columns).enumerate().for_each(|(k, rows)| {
                for (i, x) in rows.chunks_exact_mut(columns).enumerate() {
                    let Some(row) = partition.row_of(k * TASK_ROWS + i) else {
                        x[some.clone()].fill(0.0);
                        continue;
                    };
                    let strip = &strips[analysis.position[row] as usize * width..][..some.len()];
                    for ((x, strip), scale) in
                        x[some.clone()].iter_mut().zip(strip).zip(&scales[some.clone()])
                    {
                        *x = strip.to_f64() * scale;
                    }
                }
            });
        }
    }

    /// Right-hand sides in elimination order, `at(row of K11, column)`.
    fn strips(&self, columns: usize, at: impl Fn(usize, usize) -> f64) -> Lines<T> {
        let width = width::<T>(columns);
        let mut x = Lines::zeros(self.analysis.row_count() * width);
        for (x, &row) in x.chunks_exact_mut(width).zip(&self.analysis.order) {
            for (j, x) in x[..columns].iter_mut().enumerate() {
                *x = T::from_f64(at(row as usize, j));
            }
        }
        x
    }

    /// Calls `visit(row of K11, column, number)` for what [`FrontFactor::strips`] has filled.
    fn each_number(&self, x: &[T], columns: usize, mut visit: impl FnMut(usize, usize, f64)) {
        for (x, &row) in x.chunks_exact(width::<T>(columns)).zip(&self.analysis.order) {
            for (j, x) in x[..columns].iter().enumerate() {
                visit(row as usize, j, x.to_f64());
            }
        }
    }

    /// Some rows of `K11⁻¹ B` for right-hand sides that are zero nearly everywhere.
    ///
    /// Only the fronts on the paths from the rows of `B` to the roots are passed on the way up,
    /// and those on the paths from the roots to the wanted rows on the way down.
    ///
    /// Shapes: `right_hand_sides` one list of (row of `K11`, value) per column, repeated rows add
    /// up; result `rows_wanted.len()` × columns, rows in the order asked for.
    ///
    /// # Panics
    /// If a row is not below n.
    ///
    /// Source: thesis (3.43a), columns of the compliance.
    pub fn solve_partial(
        &self,
        right_hand_sides: &[Vec<(usize, f64)>],
        rows_wanted: &[usize],
    ) -> Mat<f64> {
        let columns = right_hand_sides.len();
        let mut wanted = Mat::zeros(rows_wanted.len(), columns);
        for (k, some) in right_hand_sides.chunks(T::SLAB).enumerate() {
            let some_wanted = wanted.as_mut().get_mut(.., k * T::SLAB..k * T::SLAB + some.len());
            self.solve_partial_some(some, rows_wanted, some_wanted);
        }
        wanted
    }

    /// Wanted rows of the solutions for a few sparse right-hand sides.
    fn solve_partial_some(
        &self,
        right_hand_sides: &[Vec<(usize, f64)>],
        rows_wanted: &[usize],
        mut wanted: MatMut<'_, f64>,
    ) {
        let width = width::<T>(right_hand_sides.len());
        let analysis = &*self.analysis;
        let position = |row: usize| analysis.position[row] as usize;
        // Fronts are sorted by their first row.
        let front = |new: usize| analysis.fronts.partition_point(|f| f.first <= new) - 1;
        let len = analysis.row_count() * width;
        let mut x = Lines::zeros(len);
        let x = &mut x[..len];
        let mut paths = Paths::none(analysis);
        for (j, entries) in right_hand_sides.iter().enumerate() {
            for &(row, value) in entries {
                let new = position(row);
                x[new * width + j] += T::from_f64(value);
                paths.pass_up(analysis, front(new));
            }
        }
        for &row in rows_wanted {
            paths.pass_down(analysis, front(position(row)));
        }
        self.solve_ordered(x, width, &paths);
        for (i, &row) in rows_wanted.iter().enumerate() {
            for j in 0..right_hand_sides.len() {
                wanted[(i, j)] = x[position(row) * width + j].to_f64();
            }
        }
    }

    fn solve_ordered(&self, x: &mut [T], width: usize, paths: &Paths) {
        T::solve((&self.analysis, &self.panels), x, width, paths);
    }
}

/// Precision of a factor: `f64`, or `f32` at half the time and memory for use with refinement.
///
/// Factorisation and substitution of both are compiled once, in this crate: a crate that names a factor
/// would otherwise compile all their kernels again.
pub trait FrontPrecision: Real {
    /// Factors all fronts into their panels; `limit` numbers are the most that wait at once.
    ///
    /// # Errors
    /// As [`FrontFactor::refactor`].
    #[doc(hidden)]
    fn factor(
        into: (&FrontAnalysis, &mut [Lines<Self>]),
        stiffness: &Stiffness,
        limit: usize,
    ) -> Result<(), FrontError>;

    /// Substitutes along some paths; each row of `x` has `width` numbers.
    #[doc(hidden)]
    fn solve(by: (&FrontAnalysis, &[Lines<Self>]), x: &mut [Self], width: usize, paths: &Paths);
}

macro_rules! front_precision {
    ($real:ty) => {
        impl FrontPrecision for $real {
            fn factor(
                (analysis, panels): (&FrontAnalysis, &mut [Lines<Self>]),
                stiffness: &Stiffness,
                limit: usize,
            ) -> Result<(), FrontError> {
                let run = Run { analysis, stiffness, blocks: Blocks::new(limit) };
                run.subtrees(&analysis.roots, 0, panels).map(drop)
            }

            fn solve(
                by: (&FrontAnalysis, &[Lines<Self>]),
                x: &mut [Self],
                width: usize,
                paths: &Paths,
            ) {
                solve_ordered(by, x, width, paths);
            }
        }
    };
}

front_precision!(f64);
front_precision!(f32);

/// A factorisation, while it is made.
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
