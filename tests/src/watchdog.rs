//! Time limit on work that must not hang.

use std::sync::mpsc::{RecvTimeoutError, channel};
use std::time::{Duration, Instant};

/// Runs `work` on a thread of its own; passes on its outcome or its panic.
///
/// # Panics
/// If the limit passes first, or if the work panics.
pub fn within<T: Send + 'static>(
    limit: Duration,
    what: &str,
    work: impl FnOnce() -> T + Send + 'static,
) -> T {
    let (sender, receiver) = channel();
    let thread = std::thread::spawn(move || {
        // The receiver is gone only if the limit has passed, and then the test has failed.
        let _ = sender.send(work());
    });
    match receiver.recv_timeout(limit) {
        Ok(outcome) => outcome,
        Err(RecvTimeoutError::Timeout) => panic!("{what} hangs: not done after {limit:?}"),
        Err(RecvTimeoutError::Disconnected) => match thread.join() {
            Err(panic) => std::panic::resume_unwind(panic),
            Ok(()) => unreachable!("the work ended without an outcome"),
        },
    }
}

/// Calls `ready` again and again until it returns true.
///
/// # Panics
/// If that takes longer than `limit`.
pub fn until(limit: Duration, what: &str, mut ready: impl FnMut() -> bool) {
    let start = Instant::now();
    while !ready() {
        assert!(start.elapsed() < limit, "{what}: not after {limit:?}");
        std::thread::yield_now();
    }
}
