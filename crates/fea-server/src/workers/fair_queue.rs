//! Queue in which sessions take turns by the cost of their work, so that no session waits for ever.

use std::cmp::Reverse;
use std::collections::{BTreeMap, BinaryHeap};
use std::sync::atomic::{AtomicU64, Ordering::Relaxed};

/// Session, as the queue knows it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct Asker(u64);

impl Asker {
    /// New asker, different from all others.
    pub fn new() -> Self {
        static NEXT: AtomicU64 = AtomicU64::new(1);
        Self(NEXT.fetch_add(1, Relaxed))
    }
}

/// Asker of a piece of work, and its predicted cost.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Turn {
    pub asker: Asker,
    /// Predicted time on all threads, ms.
    pub cost_ms: f64,
}

/// Waiting work in the order of self-clocked fair queueing (Golestani 1994): every piece is given the
/// time at which it would end if all askers shared the threads evenly, and the earliest comes first.
///
/// So cheap work comes before costly work, an asker that has had much comes after one that has had
/// little, and everything comes at last: the clock goes on, so what comes later is given later times.
///
/// Invariant: `clock ≤` the end of everything that waits.
pub(super) struct FairQueue<T> {
    waiting: BinaryHeap<Reverse<Entry<T>>>,
    /// Virtual end of the work that was begun last, ms of cost.
    clock: f64,
    /// Virtual end of each asker's newest work, as long as it is ahead of the clock.
    ends: BTreeMap<Asker, f64>,
    /// Number of pieces that came, so that equal ones are served in order.
    count: u64,
}

struct Entry<T> {
    end: f64,
    number: u64,
    work: T,
}

/// Least cost of a piece of work, ms, so that work predicted to cost nothing takes turns too.
const COST_MS_MIN: f64 = 1e-3;

impl<T> FairQueue<T> {
    /// Empty queue.
    pub fn new() -> Self {
        Self { waiting: BinaryHeap::new(), clock: 0.0, ends: BTreeMap::new(), count: 0 }
    }

    /// Adds a piece of work.
    pub fn push(&mut self, turn: Turn, work: T) {
        let cost_ms = match turn.cost_ms.is_finite() {
            true => turn.cost_ms.max(COST_MS_MIN),
            false => f64::MAX.sqrt(),
        };
        let begin = self.ends.get(&turn.asker).copied().unwrap_or(0.0).max(self.clock);
        let end = begin + cost_ms;
        self.ends.insert(turn.asker, end);
        self.count += 1;
        self.waiting.push(Reverse(Entry { end, number: self.count, work }));
    }

    /// Takes the piece of work whose turn it is.
    pub fn pop(&mut self) -> Option<T> {
        let Reverse(Entry { end, work, .. }) = self.waiting.pop()?;
        self.clock = end;
        if self.waiting.is_empty() {
            // Nobody has had more than another who waits.
            (self.clock, self.count) = (0.0, 0);
            self.ends.clear();
        } else {
            self.ends.retain(|_, of_asker| *of_asker > end);
        }
        Some(work)
    }
}

impl<T> PartialEq for Entry<T> {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other).is_eq()
    }
}

impl<T> Eq for Entry<T> {}

impl<T> PartialOrd for Entry<T> {
    fn partial_cmp(&self, other: &Self) -> Option<std::cmp::Ordering> {
        Some(self.cmp(other))
    }
}

impl<T> Ord for Entry<T> {
    fn cmp(&self, other: &Self) -> std::cmp::Ordering {
        self.end.total_cmp(&other.end).then(self.number.cmp(&other.number))
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn turn(asker: u64, cost_ms: f64) -> Turn {
        Turn { asker: Asker(asker), cost_ms }
    }

    fn all<T>(queue: &mut FairQueue<T>) -> Vec<T> {
        std::iter::from_fn(|| queue.pop()).collect()
    }

    #[test]
    fn cheap_work_comes_before_costly_work_and_equals_in_order() {
        let mut queue = FairQueue::new();
        for (i, cost_ms) in [1000.0, 1000.0, 40.0, 40.0].into_iter().enumerate() {
            queue.push(turn(i as u64, cost_ms), i);
        }
        assert_eq!(all(&mut queue), [2, 3, 0, 1]);
    }

    #[test]
    fn an_asker_with_much_work_takes_turns_with_one_that_has_little() {
        let mut queue = FairQueue::new();
        for i in 0..20 {
            queue.push(turn(1, 100.0), i);
        }
        for i in 100..103 {
            queue.push(turn(2, 100.0), i);
        }
        assert_eq!(all(&mut queue)[..7], [0, 100, 1, 101, 2, 102, 3]);
    }

    #[test]
    fn costly_work_is_not_passed_by_cheap_work_for_ever() {
        let mut queue = FairQueue::new();
        queue.push(turn(1, 1000.0), 0);
        let mut passed = 0;
        // A new asker comes with cheap work whenever some was begun.
        for asker in 2.. {
            queue.push(turn(asker, 10.0), 1);
            match queue.pop() {
                Some(0) => break,
                _ => passed += 1,
            }
        }
        assert!((99..=100).contains(&passed), "passed by {passed}, worth as much as itself");
    }

    #[test]
    fn numbers_that_make_no_sense_wait_at_the_end_and_come_at_last() {
        let mut queue = FairQueue::new();
        for (i, cost_ms) in [f64::NAN, f64::INFINITY, -1.0, 5.0].into_iter().enumerate() {
            queue.push(turn(i as u64, cost_ms), i);
        }
        assert_eq!(all(&mut queue), [2, 3, 0, 1]);
    }

    proptest! {
        /// An asker never waits longer than while everybody who waits has had as much as it asked
        /// for, and the piece that each of them was at.
        #[test]
        fn nobody_waits_for_more_than_their_share(
            costs in prop::collection::vec((0u64..5, 1u32..200), 1..60)
        ) {
            let mut queue = FairQueue::new();
            for (i, &(asker, cost)) in costs.iter().enumerate() {
                queue.push(turn(asker, f64::from(cost)), i);
            }
            let order = all(&mut queue);
            prop_assert_eq!(order.len(), costs.len());
            for asker in 0..5 {
                let own = |i: &usize| costs[*i].0 == asker;
                let Some(first) = order.iter().position(own) else { continue };
                let cost = costs[order[first]].1;
                for other in (0..5).filter(|other| *other != asker) {
                    let before: u32 = order[..first]
                        .iter()
                        .filter(|i| costs[**i].0 == other)
                        .map(|i| costs[*i].1)
                        .sum();
                    prop_assert!(before <= cost, "{before} of {other} before {cost} of {asker}");
                }
                let pieces: Vec<usize> = order.iter().copied().filter(own).collect();
                prop_assert!(pieces.is_sorted(), "one asker's work stays in order");
            }
        }
    }
}
