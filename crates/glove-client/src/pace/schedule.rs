//! Keeping a schedule: which tick is due, waiting for the next one, and the right to run first.

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
    /// Its name in reports.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Free => "free",
            Self::Lockstep => "lockstep",
        }
    }
}

/// The tick that is due, and how many before it were missed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Due {
    /// Number of the tick, from 0.
    pub tick: u64,
    /// Ticks since the last one that was played whose time is over: they are never played.
    pub skipped: u64,
}

/// Ticks in real time: tick `n` is due from `n` periods after the start, for one period.
#[derive(Clone, Debug)]
pub struct Schedule {
    period: Duration,
    /// First tick that was neither played nor skipped.
    next: u64,
}

impl Schedule {
    /// A schedule whose first tick is due at the start.
    ///
    /// A period of nothing would make every tick late; the shortest is a nanosecond.
    pub fn new(period: Duration) -> Self {
        Self { period: period.max(Duration::from_nanos(1)), next: 0 }
    }

    /// The tick to play at a moment, counted from the start: the newest whose time has come. Those
    /// before it that were not played are skipped.
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

/// Before its moment a thread is awake for so long: as late as it is usually woken.
const AWAKE: Duration = Duration::from_micros(150);

/// Asks that the calling thread be run as soon as it has something to do; says whether it is. It
/// must start no thread afterwards, and rest most of the time.
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
