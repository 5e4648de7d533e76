//! Clock of a run: it is stopped while the run is paused, so that no tick is late afterwards.

use std::time::{Duration, Instant};

/// Time since the first tick was due, without pauses. The caller passes the present time.
#[derive(Clone, Copy, Debug)]
pub struct RunClock {
    start: Instant,
    /// Time that the clock shows while it is stopped.
    stands_at: Option<Duration>,
}

impl RunClock {
    /// A clock that starts now.
    pub const fn start(now: Instant) -> Self {
        Self { start: now, stands_at: None }
    }

    /// Time that the clock shows.
    pub fn at(&self, now: Instant) -> Duration {
        self.stands_at.unwrap_or_else(|| now.saturating_duration_since(self.start))
    }

    /// Moment at which the clock will show a time, if it is not stopped.
    pub fn moment_of(&self, at: Duration) -> Instant {
        self.start + at
    }

    /// Stops the clock, at the time `at_most` if it shows more.
    pub fn stop(&mut self, now: Instant, at_most: Duration) {
        self.stands_at = Some(self.at(now).min(at_most));
    }

    /// Sets a stopped clock forward to a time.
    pub fn set_forward(&mut self, at: Duration) {
        self.stands_at = self.stands_at.map(|stands_at| stands_at.max(at));
    }

    /// Starts a stopped clock again.
    pub fn go_on(&mut self, now: Instant) {
        if let Some(at) = self.stands_at.take() {
            // A run cannot be older than the machine's own clock.
            self.start = now.checked_sub(at).unwrap_or(now);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pace::{Due, Schedule};

    #[test]
    fn pause_makes_no_tick_late_and_steps_are_due_one_by_one() {
        let ms = Duration::from_millis;
        let began = Instant::now();
        let (mut clock, mut schedule) = (RunClock::start(began), Schedule::new(ms(10)));
        let due = |tick| Due { tick, skipped: 0 };
        assert_eq!(schedule.due(clock.at(began)), due(0));
        assert_eq!(schedule.due(clock.at(began + ms(10))), due(1));
        // Late by half a second; the tick that is due then is the next one all the same.
        clock.stop(began + ms(514), schedule.next_at());
        assert_eq!(clock.at(began + ms(700)), ms(20));
        for tick in [2, 3] {
            clock.set_forward(schedule.next_at());
            assert_eq!(schedule.due(clock.at(began + ms(700))), due(tick));
        }
        // Half a minute later it goes on where it stood, at 30 ms.
        let later = began + ms(30_000);
        clock.go_on(later);
        assert_eq!(clock.moment_of(schedule.next_at()), later + ms(10));
        assert_eq!(schedule.due(clock.at(later + ms(10))), due(4));
        assert_eq!(schedule.due(clock.at(later + ms(31))), Due { tick: 6, skipped: 1 });
    }
}
