//! Collects samples of a live device: while a person gets ready, and while a gesture is held.

use std::time::{Duration, Instant};

use anyhow::bail;

/// Time for a person to get ready, and limits on a device's silence.
#[derive(Clone, Copy, Debug)]
pub(super) struct Patience {
    /// Count-down before each gesture.
    pub(super) get_ready: Duration,
    /// Silence of a device in a gesture after which the gesture begins again, because a person does not
    /// hold it for ever.
    pub(super) gap: Duration,
    /// Silence after which a device is given up. Until then its driver sets it up again and again, as in
    /// a run.
    pub(super) silence: Duration,
}

impl Patience {
    /// Times for a person. A CyberGlove takes up to 2.5 s to restart, a FASTRAK 10 s.
    pub(super) const PERSON: Self = Self {
        get_ready: Duration::from_secs(3),
        gap: Duration::from_secs(1),
        silence: Duration::from_secs(30),
    };
}

/// Phase of a gesture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Phase {
    /// Count-down before the gesture.
    GetReady {
        /// Seconds left, rounded up.
        seconds: u64,
    },
    /// The gesture is held and samples are collected.
    Hold {
        /// Number of samples still wanted.
        left: usize,
    },
}

/// Waits for the count-down, from the first sample on, then collects `wanted` samples; `seen` gets every
/// sample of both. After a gap in the gesture both begin again.
///
/// # Errors
/// A sentence when the device is silent for too long.
pub(super) fn collect<T>(
    next: &mut dyn FnMut() -> Option<T>,
    wanted: usize,
    patience: &Patience,
    mut seen: impl FnMut(Phase, &T),
) -> anyhow::Result<Vec<T>> {
    let mut heard = Instant::now();
    let mut begun: Option<Instant> = None;
    let mut held = Vec::new();
    while held.len() < wanted {
        let Some(sample) = next() else {
            if heard.elapsed() >= patience.silence {
                bail!(
                    "the device has sent nothing for {:.0} s; look at its plug, its switch and its \
                     port",
                    patience.silence.as_secs_f64()
                );
            }
            std::thread::sleep(Duration::from_millis(2));
            continue;
        };
        if begun.is_some() && heard.elapsed() >= patience.gap {
            held.clear();
            begun = None;
        }
        heard = Instant::now();
        let waiting = patience.get_ready.saturating_sub(begun.get_or_insert(heard).elapsed());
        if waiting.is_zero() {
            seen(Phase::Hold { left: wanted - held.len() }, &sample);
            held.push(sample);
        } else {
            seen(Phase::GetReady { seconds: waiting.as_secs_f64().ceil() as u64 }, &sample);
        }
    }
    Ok(held)
}

#[cfg(test)]
mod tests {
    use super::*;

    const PATIENT: Patience = Patience {
        get_ready: Duration::ZERO,
        gap: Duration::from_secs(20),
        silence: Duration::from_secs(30),
    };

    /// Longer than a glove takes to restart, and longer than it was given once.
    #[test]
    fn glove_that_restarts_for_two_and_a_half_seconds_is_waited_for_as_in_a_run() {
        assert!(Patience::PERSON.silence >= Duration::from_secs(20), "a restart and a lost order");
        let begun = Instant::now();
        let mut next = || (begun.elapsed() > Duration::from_millis(2600)).then_some(7);
        let patience = Patience { get_ready: Duration::ZERO, ..Patience::PERSON };
        assert_eq!(collect(&mut next, 3, &patience, |_, _| {}).unwrap(), [7, 7, 7]);
    }

    #[test]
    fn gap_in_a_gesture_begins_it_again_and_does_not_abort() {
        let patience = Patience { gap: Duration::from_millis(40), ..PATIENT };
        let mut number = 0;
        let mut next = || {
            number += 1;
            if number == 3 {
                std::thread::sleep(Duration::from_millis(60));
                return None;
            }
            Some(number)
        };
        assert_eq!(collect(&mut next, 4, &patience, |_, _| {}).unwrap(), [4, 5, 6, 7]);
    }

    #[test]
    fn samples_of_the_count_down_are_shown_and_not_kept() {
        let patience = Patience { get_ready: Duration::from_millis(30), ..PATIENT };
        let mut number = 0;
        let mut next = || {
            std::thread::sleep(Duration::from_millis(1));
            number += 1;
            (number % 3 != 0).then_some(number)
        };
        let (mut ready, mut hold) = (Vec::new(), Vec::new());
        let held = collect(&mut next, 5, &patience, |phase, &sample| match phase {
            Phase::GetReady { seconds } => {
                assert_eq!(seconds, 1);
                ready.push(sample);
            }
            Phase::Hold { .. } => hold.push(sample),
        })
        .unwrap();
        assert_eq!((held.len(), &hold), (5, &held));
        assert!(!ready.is_empty() && ready.last() < held.first());
    }

    #[test]
    fn a_silent_device_is_given_up_with_advice() {
        let patience = Patience { silence: Duration::from_millis(20), ..PATIENT };
        let error = collect(&mut || None::<u8>, 1, &patience, |_, _| {}).unwrap_err();
        assert!(error.to_string().contains("sent nothing"), "{error}");
    }
}
