//! Memory of contribution blocks: what one front needs no more the next one takes.

use std::sync::{Mutex, PoisonError};

use super::Real;
use super::lines::Lines;

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

    /// Memory for at least `len` numbers, with anything in it.
    pub fn take(&self, len: usize) -> Lines<T> {
        if len == 0 {
            return Lines::default();
        }
        let mut state = self.state.lock().unwrap_or_else(PoisonError::into_inner);
        let fitting = (0..state.idle.len())
            .filter(|&k| state.idle[k].len() >= len)
            .min_by_key(|&k| state.idle[k].len());
        if let Some(k) = fitting {
            return state.idle.swap_remove(k);
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
        given_up
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_smallest_that_fits_is_lent_again_and_others_go_when_the_limit_is_reached() {
        let blocks = Blocks::<f64>::new(48);
        let (small, large) = (blocks.take(8), blocks.take(32));
        blocks.give_back(large);
        blocks.give_back(small);
        assert_eq!(blocks.take(5).len(), 8);
        let large = blocks.take(16);
        assert_eq!(large.len(), 32, "a larger one is better than a new one");
        blocks.give_back(large);
        assert_eq!(blocks.take(40).len(), 40);
        assert_eq!(blocks.state.lock().unwrap().held, 48, "the one of 32 is gone");
        assert!(blocks.take(0).is_empty());
    }
}
