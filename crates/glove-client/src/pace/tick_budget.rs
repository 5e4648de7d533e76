//! Budget of a millisecond for which a thread with real-time priority may compute at a time.

use std::time::{Duration, Instant};

use crate::pace::be_urgent;

/// Scheduling of a thread that takes part in a tick.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Priority {
    /// Scheduled like any other thread.
    Ordinary,
    /// Scheduled before others, if the system allows it, for pieces of work of at most a millisecond.
    RealTime,
}

/// Measures the pieces of work of the calling thread, and takes its real-time priority away if they are
/// too long for the other threads.
///
/// Invariant: never `urgent` again once [`LONG_IN_A_ROW_MAX`] pieces in a row were over [`LIMIT`].
#[derive(Debug)]
pub struct TickBudget {
    /// Priority that the thread may ask for.
    priority: Priority,
    urgent: bool,
    began: Option<Moment>,
    in_a_row: u32,
    over: u64,
    longest: Duration,
}

/// Moment on the clock of the thread's computing time; on the wall clock where the system has none.
#[derive(Clone, Copy, Debug)]
enum Moment {
    Computed(Duration),
    Wall(Instant),
}

/// Longest time for which a thread with real-time priority may compute at a time.
pub const LIMIT: Duration = Duration::from_millis(1);
/// Number of long pieces in a row after which the priority is given back; one may be a page fault.
const LONG_IN_A_ROW_MAX: u32 = 3;

impl TickBudget {
    /// Budget of the calling thread, which stays ordinary until its first piece of work.
    pub const fn new(priority: Priority) -> Self {
        let (in_a_row, over, longest) = (0, 0, Duration::ZERO);
        Self { priority, urgent: false, began: None, in_a_row, over, longest }
    }

    /// Begins a piece of work, with real-time priority if it is wanted and allowed.
    pub fn begin(&mut self) {
        if self.priority == Priority::RealTime && !self.urgent {
            self.urgent = be_urgent();
            if !self.urgent {
                self.priority = Priority::Ordinary;
            }
        }
        self.began = Some(Moment::now());
    }

    /// Makes the thread ordinary until the next piece of work, because what follows may take long.
    pub fn step_back(&mut self) {
        if self.urgent {
            softgrasp_os::be_ordinary();
            self.urgent = false;
        }
    }

    /// Ends the piece of work; returns its computing time.
    pub fn end(&mut self) -> Duration {
        let computed = self.began.take().map_or(Duration::ZERO, Moment::elapsed);
        self.add(computed);
        computed
    }

    fn add(&mut self, computed: Duration) {
        self.longest = self.longest.max(computed);
        if computed <= LIMIT {
            self.in_a_row = 0;
            return;
        }
        self.over += 1;
        self.in_a_row += 1;
        if self.in_a_row >= LONG_IN_A_ROW_MAX && self.priority == Priority::RealTime {
            tracing::info!(?computed, "pieces of work over 1 ms: real-time priority is given back");
            self.priority = Priority::Ordinary;
            self.step_back();
        }
    }

    /// Priority that the thread may still ask for.
    pub fn priority(&self) -> Priority {
        self.priority
    }

    /// Number of pieces that were over the limit.
    pub fn over(&self) -> u64 {
        self.over
    }

    /// Computing time of the longest piece.
    pub fn longest(&self) -> Duration {
        self.longest
    }
}

impl Moment {
    fn now() -> Self {
        softgrasp_os::thread_cpu_time().map_or_else(|| Self::Wall(Instant::now()), Self::Computed)
    }

    fn elapsed(self) -> Duration {
        match (self, Self::now()) {
            (Self::Computed(began), Self::Computed(now)) => now.saturating_sub(began),
            (Self::Wall(began), _) => began.elapsed(),
            (Self::Computed(_), Self::Wall(_)) => Duration::ZERO,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn long_pieces_are_counted_and_three_in_a_row_end_the_right() {
        let (short, long) = (LIMIT, LIMIT + Duration::from_nanos(1));
        let mut budget = TickBudget::new(Priority::RealTime);
        for computed in [long, long, short, long, long] {
            budget.add(computed);
        }
        assert_eq!((budget.priority(), budget.over()), (Priority::RealTime, 4));
        budget.add(long);
        assert_eq!((budget.priority(), budget.over()), (Priority::Ordinary, 5));
        assert_eq!(budget.longest(), long);
    }
}
