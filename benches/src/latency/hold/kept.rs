//! Record of a loop's ticks: when each ended, and the server's times in it.

use std::time::{Duration, Instant};

use glove_client::pace::wait_until;
use softgrasp_protocol::StageMs;

/// Period of a tick; a haptic device asks a thousand times a second.
pub(super) const PERIOD: Duration = Duration::from_millis(1);

/// Record of one tick; times in ms.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Tick {
    /// Time from the moment of the tick to the end of its work.
    pub from_tick: f64,
    /// Time from the beginning of the work to its end.
    pub work: f64,
    /// Report of the answer; empty in a loop without a server.
    pub solved: Solved,
}

/// Times that an answer reports, and its error.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Solved {
    pub stages: StageMs,
    pub error_rel: f64,
    pub residual_rel: f64,
    pub error_bound_rel: Option<f64>,
}

/// Records of all ticks of one loop.
#[derive(Clone, Debug, Default)]
pub(super) struct Kept {
    pub ticks: Vec<Tick>,
    /// Number of ticks that passed while an earlier one was still at work.
    pub missed: usize,
    pub lasted: Duration,
}

impl Kept {
    /// Adds the records of a later turn.
    pub fn append(&mut self, mut later: Self) {
        self.ticks.append(&mut later.ticks);
        self.missed += later.missed;
        self.lasted += later.lasted;
    }

    /// Number of ticks, missed ones included.
    pub fn count(&self) -> usize {
        self.ticks.len() + self.missed
    }

    /// Number of ticks whose work was not done before the next one.
    pub fn late(&self) -> usize {
        let period = ms(PERIOD);
        self.ticks.iter().filter(|t| t.from_tick >= period).count() + self.missed
    }

    /// Share of late ticks, per cent.
    pub fn late_percent(&self) -> f64 {
        100.0 * self.late() as f64 / self.count().max(1) as f64
    }

    /// A value of every tick that was not missed.
    pub fn of(&self, value: fn(&Tick) -> f64) -> impl Iterator<Item = f64> + '_ {
        self.ticks.iter().map(value)
    }
}

/// Does work at each tick of an absolute schedule; a tick that passes while an earlier one is still at
/// work is missed. `prepare` runs before the tick, `work` is timed, `check` runs after it.
///
/// # Errors
/// Errors of `work` and `check`.
pub(super) fn keep<P, W, E>(
    count: usize,
    mut prepare: impl FnMut(u32) -> P,
    mut work: impl FnMut(&P) -> Result<W, E>,
    mut check: impl FnMut(u32, W) -> Result<Solved, E>,
) -> Result<Kept, E> {
    // Growing would take as long as some ticks.
    let mut kept = Kept { ticks: Vec::with_capacity(count), ..Kept::default() };
    let start = Instant::now() + 5 * PERIOD;
    for (number, tick) in (0..count as u32).map(|n| (n, start + n * PERIOD)) {
        if Instant::now() >= tick + PERIOD {
            kept.missed += 1;
            continue;
        }
        let prepared = prepare(number);
        wait_until(tick);
        let begun = Instant::now();
        let done = work(&prepared)?;
        let over = Instant::now();
        let (from_tick, work) = (ms(over - tick), ms(over - begun));
        let solved = check(number, done)?;
        kept.ticks.push(Tick { from_tick, work, solved });
    }
    kept.lasted = start.elapsed();
    Ok(kept)
}

fn ms(duration: Duration) -> f64 {
    duration.as_secs_f64() * 1e3
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_tick_is_kept_or_missed_and_late_ones_are_counted() {
        let mut is_first = true;
        let slow = |_: &u32| {
            // The first tick that is kept is at work for four periods.
            let end = Instant::now() + if is_first { 4 * PERIOD } else { Duration::ZERO };
            is_first = false;
            while Instant::now() < end {}
            Ok::<(), ()>(())
        };
        let kept = keep(20, |number| number, slow, |_, ()| Ok(Solved::default())).unwrap();
        assert_eq!(kept.count(), 20);
        assert!(kept.missed >= 2 && kept.late() > kept.missed, "{kept:?}");
        assert!(kept.ticks.iter().all(|t| t.from_tick >= t.work));
        let mut both = kept.clone();
        both.append(kept.clone());
        assert_eq!((both.count(), both.late()), (40, 2 * kept.late()));
        assert!((both.late_percent() - 5.0 * kept.late() as f64).abs() < 1e-9);
    }
}
