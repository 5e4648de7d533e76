//! The hands of a headset on their way from a page to the run, and how long they take to come back.

use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

use softgrasp_hand::joints::{JointsFeed, JointsRecord};

/// Tracked hands of a headset: those of the page which sent first, until this page falls silent.
#[derive(Default)]
pub struct Headset {
    feed: JointsFeed,
    state: Mutex<State>,
}

#[derive(Default)]
struct State {
    driver: Option<Driver>,
    latencies: Latencies,
}

/// Page whose hands are followed.
struct Driver {
    viewer: u64,
    heard: Instant,
}

/// Times from the tracked hand to the picture that shows it, over a run.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HandToPicture {
    /// Number of pictures that were the first to show a newer hand.
    pub pictures: u64,
    /// Median of the times, ms.
    pub p50_ms: u32,
    /// Time that 99 of 100 pictures did not exceed, ms.
    pub p99_ms: u32,
}

/// Time of silence after which another page's hands are followed.
const SILENT_AFTER: Duration = Duration::from_secs(1);
/// Upper end of the counted latencies, ms; longer ones count as this.
const LATENCY_MAX_MS: usize = 2000;

impl Headset {
    /// Feed that carries the joints of both hands to the run.
    pub fn feed(&self) -> JointsFeed {
        self.feed.clone()
    }

    /// Takes a hand from a page; returns whether this page is followed.
    pub fn take(&self, viewer: u64, record: &JointsRecord, now: Instant) -> bool {
        let mut state = self.state.lock().unwrap_or_else(PoisonError::into_inner);
        let holds = |driver: &Driver| {
            driver.viewer != viewer && now.saturating_duration_since(driver.heard) < SILENT_AFTER
        };
        if state.driver.as_ref().is_some_and(holds) {
            return false;
        }
        state.driver = Some(Driver { viewer, heard: now });
        drop(state);
        self.feed.set_senders(1);
        self.feed.hand_on(record, now);
        true
    }

    /// Tells that a page has gone.
    pub fn gone(&self, viewer: u64) {
        let mut state = self.state.lock().unwrap_or_else(PoisonError::into_inner);
        if state.driver.as_ref().is_some_and(|driver| driver.viewer == viewer) {
            state.driver = None;
            self.feed.set_senders(0);
        }
    }

    /// Counts the time that a hand took to a picture, ms.
    pub fn took(&self, ms: f32) {
        let mut state = self.state.lock().unwrap_or_else(PoisonError::into_inner);
        state.latencies.add(ms);
    }

    /// Times from hands to pictures; `None` where no hand was tracked.
    pub fn hand_to_picture(&self) -> Option<HandToPicture> {
        let state = self.state.lock().unwrap_or_else(PoisonError::into_inner);
        state.latencies.summary()
    }
}

/// Number of latencies for each whole millisecond.
struct Latencies(Vec<u64>);

impl Default for Latencies {
    fn default() -> Self {
        Self(vec![0; LATENCY_MAX_MS + 1])
    }
}

impl Latencies {
    fn add(&mut self, ms: f32) {
        // What is negative or no number counts as none.
        let at = (ms.ceil() as usize).min(LATENCY_MAX_MS);
        self.0[at] += 1;
    }

    fn summary(&self) -> Option<HandToPicture> {
        let pictures: u64 = self.0.iter().sum();
        let within = |share: f64| {
            let wanted = (share * pictures as f64).ceil() as u64;
            let mut so_far = 0;
            let at = self.0.iter().position(|count| {
                so_far += count;
                so_far >= wanted
            });
            u32::try_from(at.unwrap_or(LATENCY_MAX_MS)).unwrap_or(u32::MAX)
        };
        let summary = || HandToPicture { pictures, p50_ms: within(0.5), p99_ms: within(0.99) };
        (pictures > 0).then(summary)
    }
}

#[cfg(test)]
mod tests {
    use softgrasp_grasp::hand::Handedness;

    use super::*;

    #[test]
    fn both_hands_of_a_headset_are_followed_and_a_second_headset_when_the_first_is_silent() {
        let headset = Headset::default();
        let right = JointsRecord::empty(Handedness::Right);
        let left = JointsRecord::empty(Handedness::Left);
        let now = Instant::now();
        assert!(headset.take(1, &right, now));
        assert!(!headset.take(2, &right, now), "one headset is followed");
        assert!(headset.take(1, &left, now), "with both its hands");
        assert_eq!(headset.feed().senders(), 1);
        assert!(headset.take(2, &right, now + 2 * SILENT_AFTER), "the first is silent");
        headset.gone(1);
        assert_eq!(headset.feed().senders(), 1, "another one sends");
        headset.gone(2);
        assert_eq!(headset.feed().senders(), 0);
        assert_eq!(headset.feed().take().len(), 3);
    }

    #[test]
    fn latencies_are_told_by_median_and_by_the_worst_of_a_hundred() {
        let headset = Headset::default();
        assert_eq!(headset.hand_to_picture(), None);
        (1..=100).for_each(|ms| headset.took(ms as f32 - 0.5));
        let told = HandToPicture { pictures: 100, p50_ms: 50, p99_ms: 99 };
        assert_eq!(headset.hand_to_picture(), Some(told));
        headset.took(f32::MAX);
        headset.took(f32::NAN);
    }
}
