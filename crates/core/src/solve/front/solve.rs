//! Solves with a factor, over the whole tree of fronts or along a few of its paths.

use faer::{Mat, MatMut};
use rayon::prelude::*;

use super::analysis::{Front, FrontAnalysis};
use super::lines::Lines;
use super::substitute::{Panel, width};
use super::{FrontFactor, Real};
use crate::solve::Partition;

/// Subtrees whose panels times right-hand sides are below this are not split into tasks.
const SERIAL_PRODUCTS: usize = 400_000;

/// Rows that a task takes into the order of elimination or out of it.
const TASK_ROWS: usize = 256;

/// Which fronts a solve passes through; both sets are closed towards the roots.
struct Paths {
    /// Fronts that right-hand sides reach on the way up.
    up: Vec<bool>,
    /// Fronts needed on the way down.
    down: Vec<bool>,
}

impl<T: Real> FrontFactor<T> {
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
        // As many at once as fit into the strips of the kernels.
        for b in b.chunks_mut(n * T::SLAB) {
            let columns = b.len() / n;
            let mut x = self.strips(columns, |row, j| b[j * n + row]);
            self.solve_ordered(&mut x, width::<T>(columns), &self.all_paths());
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
            self.solve_ordered(&mut strips, width, &self.all_paths());
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

    fn all_paths(&self) -> Paths {
        let all = vec![true; self.analysis.fronts.len()];
        Paths { up: all.clone(), down: all }
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
        let mut paths = Paths {
            up: vec![false; analysis.fronts.len()],
            down: vec![false; analysis.fronts.len()],
        };
        for (j, entries) in right_hand_sides.iter().enumerate() {
            for &(row, value) in entries {
                let new = position(row);
                x[new * width + j] += T::from_f64(value);
                mark(&mut paths.up, analysis, front(new));
            }
        }
        for &row in rows_wanted {
            mark(&mut paths.down, analysis, front(position(row)));
        }
        self.solve_ordered(x, width, &paths);
        for (i, &row) in rows_wanted.iter().enumerate() {
            for j in 0..right_hand_sides.len() {
                wanted[(i, j)] = x[position(row) * width + j].to_f64();
            }
        }
    }

    /// Solves in elimination order, each row with `width` numbers, one for each right-hand side.
    fn solve_ordered(&self, x: &mut [T], width: usize, paths: &Paths) {
        // Lines end with a whole cache line.
        let x = &mut x[..self.analysis.row_count() * width];
        let solve = Solve { factor: self, paths, width };
        solve.up_siblings(&self.analysis.roots, 0, x);
        solve.down_siblings(&self.analysis.roots, 0, x, &[]);
    }
}

/// Marks a front and its ancestors.
fn mark(marks: &mut [bool], analysis: &FrontAnalysis, front: usize) {
    let mut v = front;
    while let Some(seen) = marks.get_mut(v)
        && !std::mem::replace(seen, true)
    {
        v = analysis.fronts[v].parent as usize;
    }
}

/// One solve under way.
struct Solve<'a, T> {
    factor: &'a FrontFactor<T>,
    paths: &'a Paths,
    /// Numbers of a row.
    width: usize,
}

impl<T: Real> Solve<'_, T> {
    fn front(&self, v: usize) -> &Front {
        &self.factor.analysis.fronts[v]
    }

    fn is_serial(&self, v: usize) -> bool {
        self.front(v).subtree_entries * self.width < SERIAL_PRODUCTS
    }

    /// The subtrees of siblings with their parts of `x`, which starts at front `first`.
    fn split<'x>(&self, heads: &[u32], first: usize, x: &'x mut [T]) -> Vec<(usize, &'x mut [T])> {
        let (mut rest, mut start) =
            (x, self.factor.analysis.fronts.get(first).map_or(0, |f| f.first));
        let mut parts = Vec::with_capacity(heads.len());
        for &head in heads {
            let head = head as usize;
            let end = self.front(head).first + self.front(head).pivots;
            let (own, tail) = rest.split_at_mut((end - start) * self.width);
            parts.push((head, own));
            (rest, start) = (tail, end);
        }
        parts
    }

    /// Forward substitution in sibling subtrees; what they hand to their parent, in their order.
    fn up_siblings(&self, heads: &[u32], first: usize, x: &mut [T]) -> Vec<Vec<T>> {
        let parts = self.split(heads, first, x);
        let task = |(head, x): (usize, &mut [T])| self.up(head, x);
        match parts.iter().filter(|(head, _)| !self.is_serial(*head)).count() {
            0 | 1 => parts.into_iter().map(task).collect(),
            _ => parts.into_par_iter().map(task).collect(),
        }
    }

    fn up(&self, head: usize, x: &mut [T]) -> Vec<T> {
        if !self.paths.up[head] {
            return Vec::new();
        }
        let first = self.front(head).subtree_first as usize;
        let start = self.front(first).first;
        let bottom = self.bottom(head);
        let (below, mut own) = x.split_at_mut((self.front(bottom).first - start) * self.width);
        let mut handed = match self.is_serial(bottom) {
            true => self.up_serial(first, bottom, below),
            false => self.up_siblings(&self.front(bottom).children, first, below),
        };
        for v in bottom..=head {
            let (pivots, rest) = own.split_at_mut(self.front(v).pivots * self.width);
            handed = vec![self.up_front(v, pivots, &handed)];
            own = rest;
        }
        handed.pop().unwrap_or_default()
    }

    /// Lowest front of the chain of only children below a front that is worth splitting.
    fn bottom(&self, head: usize) -> usize {
        let mut bottom = head;
        while !self.is_serial(bottom)
            && let [only] = self.front(bottom).children[..]
        {
            bottom = only as usize;
        }
        bottom
    }

    /// All fronts below `head`, one after another; what `head`'s children hand to it.
    fn up_serial(&self, first: usize, head: usize, x: &mut [T]) -> Vec<Vec<T>> {
        let mut stack: Vec<Vec<T>> = Vec::new();
        let mut rest = x;
        for v in first..head {
            let (pivots, tail) = rest.split_at_mut(self.front(v).pivots * self.width);
            rest = tail;
            let children = stack.split_off(stack.len() - self.front(v).children.len());
            stack.push(match self.paths.up[v] {
                true => self.up_front(v, pivots, &children),
                false => Vec::new(),
            });
        }
        stack
    }

    /// One front: adds what its children hand it and eliminates; the whole front with its zero rows,
    /// whose rest is for the parent.
    fn up_front(&self, v: usize, x1: &mut [T], handed: &[Vec<T>]) -> Vec<T> {
        let (front, width) = (self.front(v), self.width);
        let slabs = front.slabs::<T>();
        let mut local = vec![T::ZERO; slabs.padded_rows() * width];
        local[..x1.len()].copy_from_slice(x1);
        for (&child, values) in front.children.iter().zip(handed).filter(|(_, h)| !h.is_empty()) {
            let child = self.front(child as usize);
            let rest = &values[child.slabs::<T>().padded(child.pivots) * width..];
            for run in &child.runs {
                let from = &rest[run.child as usize * width..][..run.len as usize * width];
                let into = &mut local[slabs.padded(run.parent as usize) * width..];
                into.iter_mut().zip(from).for_each(|(slot, &value)| *slot += value);
            }
        }
        self.panel(v).forward(&mut local, width);
        x1.copy_from_slice(&local[..x1.len()]);
        local
    }

    /// Backward substitution in sibling subtrees; `above` holds the parent's front.
    fn down_siblings(&self, heads: &[u32], first: usize, x: &mut [T], above: &[T]) {
        let parts = self.split(heads, first, x);
        let task = |(head, x): (usize, &mut [T])| self.down(head, x, above);
        match parts.iter().filter(|(head, _)| !self.is_serial(*head)).count() {
            0 | 1 => parts.into_iter().for_each(task),
            _ => parts.into_par_iter().for_each(task),
        }
    }

    fn down(&self, head: usize, x: &mut [T], above: &[T]) {
        if !self.paths.down[head] {
            return;
        }
        let first = self.front(head).subtree_first as usize;
        let start = self.front(first).first;
        let bottom = self.bottom(head);
        let (below, mut own) = x.split_at_mut((self.front(bottom).first - start) * self.width);
        let mut local = Vec::new();
        for v in (bottom..=head).rev() {
            let at = own.len() - self.front(v).pivots * self.width;
            let (rest, pivots) = own.split_at_mut(at);
            local = self.down_front(v, pivots, if v == head { above } else { &local });
            own = rest;
        }
        match self.is_serial(bottom) {
            true => self.down_serial(first, bottom, below, local),
            false => self.down_siblings(&self.front(bottom).children, first, below, &local),
        }
    }

    /// All fronts below `head`, one after another, parents first.
    fn down_serial(&self, first: usize, head: usize, x: &mut [T], local: Vec<T>) {
        // Fronts whose children are not all done yet.
        let mut open = vec![(head, local)];
        let mut rest = x;
        for v in (first..head).rev() {
            let at = rest.len() - self.front(v).pivots * self.width;
            let (head, pivots) = rest.split_at_mut(at);
            rest = head;
            if !self.paths.down[v] {
                continue;
            }
            let parent = self.front(v).parent as usize;
            open.truncate(open.iter().rposition(|(u, _)| *u == parent).map_or(0, |i| i + 1));
            let above = open.last().map_or(&[][..], |(_, local)| local);
            let local = self.down_front(v, pivots, above);
            if !self.front(v).children.is_empty() {
                open.push((v, local));
            }
        }
    }

    /// One front: takes the rest from the parent's front `above` and substitutes; the whole front
    /// with its zero rows, for the children.
    fn down_front(&self, v: usize, x1: &mut [T], above: &[T]) -> Vec<T> {
        let (front, width) = (self.front(v), self.width);
        let slabs = front.slabs::<T>();
        let mut local = vec![T::ZERO; slabs.padded_rows() * width];
        local[..x1.len()].copy_from_slice(x1);
        let rest = &mut local[slabs.padded(front.pivots) * width..];
        for run in &front.runs {
            let parent = self.front(front.parent as usize).slabs::<T>();
            let from = &above[parent.padded(run.parent as usize) * width..];
            let into = &mut rest[run.child as usize * width..][..run.len as usize * width];
            into.copy_from_slice(&from[..into.len()]);
        }
        self.panel(v).backward(&mut local, width);
        x1.copy_from_slice(&local[..x1.len()]);
        local
    }

    fn panel(&self, v: usize) -> Panel<'_, T> {
        let slabs = self.front(v).slabs::<T>();
        Panel { values: &self.factor.panels[v], slabs }
    }
}
