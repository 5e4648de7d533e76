//! What arrived from the devices and has not been taken yet, never more than a fixed number.

use std::collections::VecDeque;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::Instant;

use crate::sent::Device;

/// Bytes of a device: a whole record or reply, or bytes that are none.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Arrived {
    /// Device that sent the bytes.
    pub device: Device,
    /// When the first of the bytes arrived.
    pub arrived: Instant,
    /// The bytes, as they came.
    pub bytes: Vec<u8>,
}

/// Pieces of bytes of both devices, first in, first out.
#[derive(Debug, Default)]
pub(super) struct Arrivals {
    waiting: Mutex<VecDeque<Arrived>>,
    dropped: AtomicU64,
}

impl Arrivals {
    /// Most pieces that wait: those of some half minute of both devices at their full rates.
    pub(super) const LIMIT: usize = 8192;

    /// Adds a piece; when there are too many the oldest is dropped and counted.
    pub(super) fn push(&self, arrived: Arrived) {
        let mut waiting = self.lock();
        if waiting.len() >= Self::LIMIT {
            waiting.pop_front();
            self.dropped.fetch_add(1, Ordering::Relaxed);
        }
        waiting.push_back(arrived);
    }

    /// Takes all pieces, in order of arrival.
    pub(super) fn take(&self) -> Vec<Arrived> {
        let mut taken: Vec<Arrived> = std::mem::take(&mut *self.lock()).into();
        // A record is added when it is complete; one of the other device may have begun before it.
        // The sort is stable: it leaves the order of each device as it is.
        taken.sort_by_key(|arrived| arrived.arrived);
        taken
    }

    /// Number of pieces that were dropped so far.
    pub(super) fn dropped(&self) -> u64 {
        self.dropped.load(Ordering::Relaxed)
    }

    fn lock(&self) -> MutexGuard<'_, VecDeque<Arrived>> {
        // Nothing is left half done by a thread that ended while it held the lock.
        self.waiting.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_oldest_are_dropped_and_counted() {
        let arrivals = Arrivals::default();
        let count = Arrivals::LIMIT + 3;
        for number in 0..count {
            let bytes = number.to_le_bytes().to_vec();
            arrivals.push(Arrived { device: Device::Glove, arrived: Instant::now(), bytes });
        }
        assert_eq!(arrivals.dropped(), 3);
        let taken = arrivals.take();
        assert_eq!(
            (taken.len(), &taken[0].bytes[..]),
            (Arrivals::LIMIT, &3usize.to_le_bytes()[..])
        );
        assert!(arrivals.take().is_empty());
    }
}
