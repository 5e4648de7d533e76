//! The hands of a runtime, followed on a thread of their own.

use std::sync::Arc;
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use super::error::RuntimeError;
#[cfg(feature = "openxr")]
use super::follower;
use super::runtime_feed::RuntimeFeed;
use super::wanted::WantedHands;
use crate::joints::ArrivedBytes;
use crate::notice::Notice;

/// Longest wait for the thread to end.
const END_MAX: Duration = Duration::from_secs(1);

/// Follows the hands of an OpenXR runtime until it is dropped, on a thread of its own.
///
/// A runtime that is lost is looked for every second. To be opened before its owner asks for real-time
/// priority, which a new thread would inherit.
#[derive(Debug)]
pub struct RuntimeHands {
    feed: Arc<RuntimeFeed>,
    thread: Option<JoinHandle<()>>,
}

impl RuntimeHands {
    /// Opens a session without graphics, and waits until the runtime has granted it.
    ///
    /// Units: the runtime is asked once in `period`, which is brought between 1 ms and 33 ms.
    ///
    /// # Errors
    /// [`RuntimeError`]: no loader, no runtime, one without hands or without a headset.
    #[cfg(feature = "openxr")]
    pub fn open(wanted: WantedHands, period: Duration) -> Result<Self, RuntimeError> {
        let feed = Arc::new(RuntimeFeed::default());
        let thread = follower::start(wanted, period, Arc::clone(&feed))?;
        Ok(Self { feed, thread: Some(thread) })
    }

    /// Refuses: this build asks no runtime.
    ///
    /// # Errors
    /// [`RuntimeError::NotBuilt`].
    #[cfg(not(feature = "openxr"))]
    pub fn open(_: WantedHands, _: Duration) -> Result<Self, RuntimeError> {
        Err(RuntimeError::NotBuilt)
    }

    /// All lines of joints since the last call, oldest first. Never waits for the runtime.
    pub fn take(&self) -> Vec<ArrivedBytes> {
        self.feed.joints.take()
    }

    /// Number of lines that were thrown away because they were not taken in time.
    pub fn dropped(&self) -> u64 {
        self.feed.joints.dropped()
    }

    /// What is wrong with the runtime, or what it waits for; `None` while it sees a hand.
    pub fn complaint(&self) -> Option<Notice> {
        self.feed.complaint()
    }
}

impl Drop for RuntimeHands {
    /// Ends the thread and waits for it, but not for a runtime that hangs: a thread inside that is left to
    /// the end of the process.
    fn drop(&mut self) {
        self.feed.end();
        let Some(thread) = self.thread.take() else { return };
        let begun = Instant::now();
        while !thread.is_finished() && begun.elapsed() < END_MAX {
            std::thread::sleep(Duration::from_millis(2));
        }
        if thread.is_finished() {
            // A panic has been printed.
            let _ = thread.join();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_wrong_is_told_until_it_is_right_and_the_end_is_heard() {
        let feed = Arc::new(RuntimeFeed::default());
        let hands = RuntimeHands { feed: Arc::clone(&feed), thread: None };
        assert_eq!(hands.complaint(), None);
        feed.complain(Some(Notice::waits("no hand is seen")));
        assert_eq!(hands.complaint(), Some(Notice::waits("no hand is seen")));
        feed.complain(None);
        assert_eq!((hands.complaint(), feed.is_over()), (None, false));
        drop(hands);
        assert!(feed.is_over());
    }

    #[test]
    fn runtime_that_hangs_does_not_keep_the_program() {
        let (let_go, hangs) = std::sync::mpsc::channel::<()>();
        let thread = std::thread::spawn(move || hangs.recv().unwrap());
        let hands = RuntimeHands { feed: Arc::default(), thread: Some(thread) };
        let begun = Instant::now();
        drop(hands);
        assert!((END_MAX..10 * END_MAX).contains(&begun.elapsed()));
        let_go.send(()).unwrap();
        let thread = std::thread::spawn(|| ());
        drop(RuntimeHands { feed: Arc::default(), thread: Some(thread) });
    }
}
