//! Limits how often something may happen: so many times at once after a pause, then at an even rate.

use std::time::{Duration, Instant};

/// Time of the next permitted event.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Pace {
    /// The next event is permitted at this time, or the time of `at_once` events earlier.
    due: Instant,
    at_once: u32,
    every: Duration,
}

/// Number of connections that are accepted at once after a pause.
const ACCEPTS_AT_ONCE: u32 = 64;
/// Time between further connections.
const ACCEPT_EVERY: Duration = Duration::from_millis(1);

impl Pace {
    /// Pace at which connections are accepted, so that many short connections cannot take all the time of
    /// the sockets' thread.
    pub fn of_connections(now: Instant) -> Self {
        Self::new(now, ACCEPTS_AT_ONCE, ACCEPT_EVERY)
    }

    /// Pace before the first event: `at_once` events after a pause, then one in each `every`.
    pub fn new(now: Instant, at_once: u32, every: Duration) -> Self {
        Self { due: now, at_once, every }
    }

    /// Time at which the next event is permitted.
    pub fn next(&self) -> Instant {
        self.due.checked_sub(self.at_once * self.every).unwrap_or(self.due)
    }

    /// Counts an event.
    pub fn came(&mut self, now: Instant) {
        self.due = self.due.max(now) + self.every;
    }

    /// Whether there was no event for so long that the pace equals a new one.
    pub fn has_rested(&self, now: Instant) -> bool {
        self.due <= now
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_burst_comes_at_once_and_an_endless_crowd_at_its_pace() {
        let (start, every) = (Instant::now(), Duration::from_millis(1));
        let mut pace = Pace::new(start, 64, every);
        for _ in 0..64 {
            assert!(pace.next() <= start);
            pace.came(start);
        }
        assert!(!pace.has_rested(start));
        for more in 0..100 {
            assert_eq!(pace.next(), start + more * every);
            pace.came(pace.next());
        }
        // After a pause there is room for a burst again.
        let later = start + Duration::from_secs(10);
        assert!(pace.has_rested(later));
        pace.came(later);
        assert!(pace.next() <= later);
    }
}
