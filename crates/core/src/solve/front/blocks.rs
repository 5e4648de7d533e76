//! Memory of contribution blocks: what one front needs no more the next one takes.

use std::sync::{Mutex, PoisonError};

use super::Real;
use super::slabs::{BlockSlabs, Lines};

/// A front's contribution block on its way to the parent.
///
/// Shapes: as `shape` says.
#[derive(Default)]
pub(super) struct Block<T> {
    pub shape: BlockSlabs,
    /// Columns that the parent eliminates; empty as soon as its panel is filled.
    pub eliminated: Lines<T>,
    /// Columns that the parent passes on.
    pub passed_on: Lines<T>,
}

impl<T: Real> Block<T> {
    /// A column of a slab and those behind it that lie in the same piece of memory.
    #[inline(always)]
    pub fn columns(&self, slab: usize, column: usize) -> &[T] {
        let (shape, height) = (self.shape, self.shape.height);
        match column.checked_sub(shape.cut * height) {
            None => &self.eliminated[shape.eliminated_start(slab) + column * height..],
            Some(column) => &self.passed_on[shape.passed_on_start(slab) + column * height..],
        }
    }
}

/// Blocks that wait for the next front, within what a factor may hold.
///
/// Memory that a thread has touched before costs no page faults and needs no zeros: every number of
/// a block is written before it is read.
pub(super) struct Blocks<T> {
    /// Numbers held at most, lent ones and panels included.
    limit: usize,
    state: Mutex<State<T>>,
}

struct State<T> {
    idle: Vec<Lines<T>>,
    /// Numbers lent and idle, and of panels.
    held: usize,
}

impl<T: Real> Blocks<T> {
    /// Units: `limit` numbers.
    pub fn new(limit: usize) -> Self {
        Self { limit, state: Mutex::new(State { idle: Vec::new(), held: 0 }) }
    }

    /// Memory for a contribution block, with anything in it.
    pub fn block(&self, shape: BlockSlabs) -> Block<T> {
        let eliminated = self.take(shape.eliminated_len());
        Block { shape, eliminated, passed_on: self.take(shape.passed_on_len()) }
    }

    /// Memory for at least `len` numbers, with anything in it.
    fn take(&self, len: usize) -> Lines<T> {
        if len == 0 {
            return Lines::default();
        }
        let mut state = self.state.lock().unwrap_or_else(PoisonError::into_inner);
        let fitting = (0..state.idle.len())
            .filter(|&k| state.idle[k].len() >= len)
            .min_by_key(|&k| state.idle[k].len());
        if let Some(k) = fitting {
            let mut block = state.idle.swap_remove(k);
            state.held -= block.len();
            let given_up = state.make_room(len, self.limit);
            drop(state);
            drop(given_up);
            // What is lent counts in full, and the limit counts only what is needed.
            block.shorten(len);
            return block;
        }
        let given_up = state.make_room(len, self.limit);
        // The system may take its time for both.
        drop(state);
        drop(given_up);
        Lines::zeros(len)
    }

    /// Zeros that are never given back, for a panel.
    pub fn keep(&self, len: usize) -> Lines<T> {
        let mut state = self.state.lock().unwrap_or_else(PoisonError::into_inner);
        let given_up = state.make_room(len, self.limit);
        drop(state);
        drop(given_up);
        Lines::zeros(len)
    }

    /// Takes memory back.
    pub fn give_back(&self, block: Lines<T>) {
        if !block.is_empty() {
            self.state.lock().unwrap_or_else(PoisonError::into_inner).idle.push(block);
        }
    }
}

impl<T: Real> State<T> {
    /// Counts so many numbers more; returns idle blocks that have to go, so that all are within the
    /// limit.
    fn make_room(&mut self, len: usize, limit: usize) -> Vec<Lines<T>> {
        let mut given_up = Vec::new();
        while self.held + len > limit
            && let Some(idle) = self.idle.pop()
        {
            self.held -= idle.len();
            given_up.push(idle);
        }
        self.held += len;
        debug_assert!(self.held <= limit, "{} numbers where {limit} were planned", self.held);
        given_up
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    #[should_panic(expected = "numbers where 48 were planned")]
    #[cfg(debug_assertions)]
    fn more_than_was_planned_is_noticed() {
        let blocks = Blocks::<f64>::new(48);
        let _lent = (blocks.take(8), blocks.take(48));
    }

    #[test]
    fn the_smallest_that_fits_is_lent_again_and_others_go_when_the_limit_is_reached() {
        let blocks = Blocks::<f64>::new(48);
        let held = || blocks.state.lock().unwrap().held;
        let (small, large) = (blocks.take(8), blocks.take(32));
        blocks.give_back(large);
        blocks.give_back(small);
        assert_eq!((blocks.take(8).len(), held()), (8, 40));
        let shorter = blocks.take(16);
        assert_eq!((shorter.len(), held()), (16, 24), "what is lent and not needed is given up");
        blocks.give_back(shorter);
        assert_eq!((blocks.take(40).len(), held()), (40, 48), "the one of 16 is gone");
        assert!(blocks.take(0).is_empty());
    }
}
