//! Collects samples of a live device: while a person gets ready, and while a gesture is held.

use std::time::{Duration, Instant};

use anyhow::bail;

/// How long a person gets ready, and how long a device may be silent.
#[derive(Clone, Copy, Debug)]
pub(super) struct Patience {
    /// Count-down before each gesture.
    pub(super) get_ready: Duration,
    /// A device that sends nothing for so long is given up.
    pub(super) silence: Duration,
}

impl Patience {
    /// For a person.
    pub(super) const PERSON: Self =
        Self { get_ready: Duration::from_secs(3), silence: Duration::from_secs(2) };
}

/// Where a gesture is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Phase {
    /// So many seconds are left to get ready.
    GetReady {
        /// Seconds, rounded up.
        seconds: u64,
    },
    /// So many samples are still wanted.
    Hold {
        /// Samples.
        left: usize,
    },
}

/// Waits out the count-down, then collects `wanted` samples; `seen` gets every sample of both.
///
/// # Errors
/// A sentence when the device is silent for too long.
pub(super) fn collect<T>(
    next: &mut dyn FnMut() -> Option<T>,
    wanted: usize,
    patience: &Patience,
    mut seen: impl FnMut(Phase, &T),
) -> anyhow::Result<Vec<T>> {
    let start = Instant::now();
    let mut heard = start;
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
        heard = Instant::now();
        let waiting = patience.get_ready.saturating_sub(start.elapsed());
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

    #[test]
    fn samples_of_the_count_down_are_shown_and_not_kept() {
        let patience =
            Patience { get_ready: Duration::from_millis(30), silence: Duration::from_secs(20) };
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
        let patience = Patience { get_ready: Duration::ZERO, silence: Duration::from_millis(20) };
        let error = collect(&mut || None::<u8>, 1, &patience, |_, _| {}).unwrap_err();
        assert!(error.to_string().contains("sent nothing"), "{error}");
    }
}
