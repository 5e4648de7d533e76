//! Keeping a schedule: threads are woken late, by a tenth of a millisecond and at times by more.

use std::time::{Duration, Instant};

/// Before its moment a thread is awake for so long: as late as it is usually woken.
const AWAKE: Duration = Duration::from_micros(150);

/// Asks that the calling thread be run as soon as it has something to do; says whether it is. It
/// must start no thread afterwards, and rest most of the time.
pub fn be_urgent() -> bool {
    let asked = softgrasp_os::be_urgent();
    if let Err(error) = &asked {
        tracing::debug!(%error, "this thread is one of many");
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
}
