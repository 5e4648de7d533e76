//! Schedule of ticks: which one is due, waiting for the next, and real-time scheduling of the thread.

use std::time::{Duration, Instant};

/// How the ticks and the server keep step.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Pace {
    /// A tick never waits for anything; an answer is shown by the tick that finds it there.
    Free,
    /// Each tick waits for its answer, for plans and for kept shapes: every run gives the same bits.
    Lockstep,
}

impl Pace {
    /// Name of the pace in reports.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Free => "free",
            Self::Lockstep => "lockstep",
        }
    }
}

/// The tick that is due, and the number of those that were missed before it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Due {
    /// Number of the tick, from 0.
    pub tick: u64,
    /// Number of ticks since the last played one whose time is over; they are never played.
    pub skipped: u64,
}

/// Ticks in real time: tick `n` is due from `n` periods after the start, for one period.
#[derive(Clone, Debug)]
pub struct Schedule {
    period: Duration,
    /// Number of the first tick that was neither played nor skipped.
    next: u64,
}

impl Schedule {
    /// Schedule whose first tick is due at the start.
    ///
    /// A period of zero would make every tick late; the shortest is a nanosecond.
    pub fn new(period: Duration) -> Self {
        Self { period: period.max(Duration::from_nanos(1)), next: 0 }
    }

    /// The tick to play at a moment, counted from the start: the newest whose time has come. Earlier ones
    /// that were not played are skipped.
    pub fn due(&mut self, elapsed: Duration) -> Due {
        let now = (elapsed.as_nanos() / self.period.as_nanos()) as u64;
        // A thread that wakes a moment too early plays the tick it was woken for.
        let tick = now.max(self.next);
        let skipped = tick - self.next;
        self.next = tick + 1;
        Due { tick, skipped }
    }

    /// Moment of the first tick that is still to come, counted from the start.
    pub fn next_at(&self) -> Duration {
        self.period.mul_f64(self.next as f64)
    }
}

/// Time before a moment for which a thread stays awake: it is usually woken as late as this.
const AWAKE: Duration = Duration::from_micros(150);

/// Asks for real-time scheduling of the calling thread; returns whether it was granted. The thread must
/// start no other thread afterwards, and sleep most of the time.
pub fn be_urgent() -> bool {
    let asked = softgrasp_os::be_urgent();
    if let Err(error) = &asked {
        tracing::debug!(%error, "this thread has no right to run before others");
    }
    asked.is_ok()
}

/// Returns at a moment: sleeps until shortly before it and stays awake for the rest.
pub fn wait_until(then: Instant) {
    let left = then.saturating_duration_since(Instant::now());
    if left > AWAKE {
        std::thread::sleep(left - AWAKE);
    }
    while Instant::now() < then {
        // Whoever else has something to do may need this processor.
        std::thread::yield_now();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nothing_returns_before_its_moment_and_the_past_returns_at_once() {
        for ms in [0, 1, 3] {
            let then = Instant::now() + Duration::from_millis(ms);
            wait_until(then);
            assert!(Instant::now() >= then);
        }
        if let Some(past) = Instant::now().checked_sub(Duration::from_millis(5)) {
            wait_until(past);
        }
    }

    #[test]
    fn missed_ticks_are_skipped_and_counted_and_never_replayed() {
        let ms = Duration::from_millis;
        let mut schedule = Schedule::new(ms(10));
        // In time, a moment early, then a second late, then in time again.
        let moments = [ms(0), Duration::from_micros(9_990), ms(20), ms(1025), ms(1030), ms(1041)];
        let played: Vec<Due> = moments.iter().map(|&at| schedule.due(at)).collect();
        let due = |tick, skipped| Due { tick, skipped };
        let expected = [due(0, 0), due(1, 0), due(2, 0), due(102, 99), due(103, 0), due(104, 0)];
        assert_eq!(played, expected);
        let skipped: u64 = played.iter().map(|d| d.skipped).sum();
        assert_eq!(skipped + played.len() as u64, 105, "every tick was played or skipped");
        assert_eq!(schedule.next_at(), ms(1050));
    }
}
