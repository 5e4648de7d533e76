//! The memory that kept models and requests under way may take together.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering::Relaxed};

use tokio::sync::Notify;
use tokio::sync::futures::Notified;

use crate::lock::Lock;

/// Memory that the server may take, and the part that is reserved for requests under way.
///
/// Invariant: what is kept between requests plus what is reserved ≤ `limit`; the store of models
/// keeps its part by [`Budget::left_for_kept`].
///
/// Units: bytes.
#[derive(Clone, Debug)]
pub(crate) struct Budget {
    limit: u64,
    reserved: Arc<Lock<u64>>,
    freed: Arc<Notify>,
}

/// Memory reserved for one request, bytes; given back when dropped.
#[derive(Debug)]
pub(crate) struct Reservation {
    budget: Budget,
    own: AtomicU64,
}

impl Budget {
    /// Budget of `limit` bytes of which nothing is reserved.
    ///
    /// Units: `limit` bytes.
    pub fn new(limit: u64) -> Self {
        Self { limit, reserved: Arc::default(), freed: Arc::default() }
    }

    /// Reservation for one request, 0 bytes at first.
    pub fn reservation(&self) -> Reservation {
        Reservation { budget: self.clone(), own: AtomicU64::new(0) }
    }

    /// The whole budget, bytes.
    pub fn limit(&self) -> u64 {
        self.limit
    }

    /// Future that ends when reserved memory is given back.
    pub fn freed(&self) -> Notified<'_> {
        self.freed.notified()
    }

    /// Bytes that the reservations leave for what is kept between requests.
    pub fn left_for_kept(&self) -> u64 {
        self.limit.saturating_sub(self.reserved.with(|reserved| *reserved))
    }
}

impl Reservation {
    /// The whole budget, bytes.
    pub fn limit(&self) -> u64 {
        self.budget.limit
    }

    /// Bytes reserved for other requests.
    pub fn of_others(&self) -> u64 {
        self.budget.reserved.with(|reserved| reserved.saturating_sub(self.own.load(Relaxed)))
    }

    /// Bytes of the budget that are not reserved for other requests.
    pub fn free(&self) -> u64 {
        self.budget.limit.saturating_sub(self.of_others())
    }

    /// Changes the reservation to the memory that is held now, even if this is more than the budget.
    pub fn settle(&self, bytes: u64) {
        self.budget.reserved.with(|reserved| self.replace(reserved, bytes));
    }

    /// Reserves `own` bytes in place of what was reserved before, beside `held` bytes that are kept
    /// already; says whether they fit, and changes nothing if they do not.
    pub fn reserve(&self, own: u64, held: u64) -> bool {
        self.budget.reserved.with(|reserved| {
            let others = reserved.saturating_sub(self.own.load(Relaxed));
            let needed = others.saturating_add(own).saturating_add(held);
            let fits = needed <= self.budget.limit;
            if fits {
                self.replace(reserved, own);
            }
            fits
        })
    }

    fn replace(&self, reserved: &mut u64, own: u64) {
        let before = self.own.swap(own, Relaxed);
        *reserved = reserved.saturating_sub(before).saturating_add(own);
        if own < before {
            self.budget.freed.notify_waiters();
        }
    }
}

impl Drop for Reservation {
    fn drop(&mut self) {
        self.settle(0);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn reservations_share_the_budget_and_give_it_back() {
        let budget = Budget::new(100);
        let (first, second) = (budget.reservation(), budget.reservation());
        assert!(first.reserve(60, 0) && !second.reserve(50, 0) && second.reserve(30, 10));
        assert_eq!((first.free(), second.free(), budget.left_for_kept()), (70, 40, 10));
        assert!(first.reserve(70, 0), "in place of what was reserved before");
        first.settle(5);
        assert_eq!((second.of_others(), budget.left_for_kept()), (5, 65));
        drop(first);
        drop(second);
        assert_eq!(budget.left_for_kept(), 100);
    }
}
