//! A pace that a crowd without end must keep: so many at once after a pause, then one at a time.

use std::time::{Duration, Instant};

/// When the next one may come.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Pace {
    /// The next one may come then, or [`Self::at_once`] earlier ones' worth before.
    due: Instant,
    at_once: u32,
    every: Duration,
}

/// Connections that are accepted at once after a pause.
const ACCEPTS_AT_ONCE: u32 = 64;
/// Time between two connections after those.
const ACCEPT_EVERY: Duration = Duration::from_millis(1);

impl Pace {
    /// That at which connections are accepted: those who come and go without end must not take the
    /// sockets' thread from those who are there.
    pub fn of_connections(now: Instant) -> Self {
        Self::new(now, ACCEPTS_AT_ONCE, ACCEPT_EVERY)
    }

    /// At which nobody has come yet: `at_once` after a pause, then one in each `every`.
    pub fn new(now: Instant, at_once: u32, every: Duration) -> Self {
        Self { due: now, at_once, every }
    }

    /// When the next one may come.
    pub fn next(&self) -> Instant {
        self.due.checked_sub(self.at_once * self.every).unwrap_or(self.due)
    }

    /// One has come.
    pub fn came(&mut self, now: Instant) {
        self.due = self.due.max(now) + self.every;
    }

    /// Whether nobody has come for so long that it is as good as new.
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
