//! Substitution over the whole tree of fronts or along a few of its paths.

use rayon::prelude::*;

use super::Real;
use super::analysis::{Front, FrontAnalysis};
use super::slabs::Lines;
use super::substitute::Panel;

/// Subtrees whose panels times right-hand sides are below this are not split into tasks.
const SERIAL_PRODUCTS: usize = 400_000;

/// Which fronts a solve passes through; both sets are closed towards the roots.
pub struct Paths {
    /// Fronts that right-hand sides reach on the way up.
    up: Vec<bool>,
    /// Fronts needed on the way down.
    down: Vec<bool>,
}

impl Paths {
    /// All fronts, both ways.
    pub fn all(analysis: &FrontAnalysis) -> Self {
        let all = vec![true; analysis.fronts.len()];
        Self { up: all.clone(), down: all }
    }

    /// Paths through no front.
    pub fn none(analysis: &FrontAnalysis) -> Self {
        let none = vec![false; analysis.fronts.len()];
        Self { up: none.clone(), down: none }
    }

    /// Passes through a front and its ancestors on the way up.
    pub fn pass_up(&mut self, analysis: &FrontAnalysis, front: usize) {
        mark(&mut self.up, analysis, front);
    }

    /// Passes through a front and its ancestors on the way down.
    pub fn pass_down(&mut self, analysis: &FrontAnalysis, front: usize) {
        mark(&mut self.down, analysis, front);
    }
}

/// Solves in elimination order along some paths, with the panels of a factor; each row of `x` has
/// `width` numbers, one for each right-hand side.
pub(super) fn solve_ordered<T: Real>(
    (analysis, panels): (&FrontAnalysis, &[Lines<T>]),
    x: &mut [T],
    width: usize,
    paths: &Paths,
) {
    // Lines end with a whole cache line.
    let x = &mut x[..analysis.row_count() * width];
    let solve = Solve { analysis, panels, paths, width };
    solve.up_siblings(&analysis.roots, 0, x);
    solve.down_siblings(&analysis.roots, 0, x, &[]);
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

/// A substitution, while it is made.
struct Solve<'a, T> {
    analysis: &'a FrontAnalysis,
    panels: &'a [Lines<T>],
    paths: &'a Paths,
    /// Numbers of a row.
    width: usize,
}

impl<T: Real> Solve<'_, T> {
    fn front(&self, v: usize) -> &Front {
        &self.analysis.fronts[v]
    }

    fn is_serial(&self, v: usize) -> bool {
        self.front(v).subtree_entries * self.width < SERIAL_PRODUCTS
    }

    /// The subtrees of siblings with their parts of `x`, which starts at front `first`.
    fn split<'x>(&self, heads: &[u32], first: usize, x: &'x mut [T]) -> Vec<(usize, &'x mut [T])> {
        let (mut rest, mut start) = (x, self.analysis.fronts.get(first).map_or(0, |f| f.first));
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
        Panel { values: &self.panels[v], slabs }
    }
}
