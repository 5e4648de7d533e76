//! Whether a client still waits for the answer to a request; work for a client that has gone ends.

use std::panic::resume_unwind;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// Held by the session that waits for an answer; dropping it tells the work.
#[derive(Default)]
pub(crate) struct Waiting(Awaited);

/// Held by the work: tells whether a session still waits.
#[derive(Clone, Default)]
pub(crate) struct Awaited {
    is_over: Arc<AtomicBool>,
}

/// Panic payload of work that ends because its client has gone; see [`Awaited::go_on`].
pub(crate) struct Abandoned;

impl Waiting {
    /// The counterpart that the work holds.
    pub fn awaited(&self) -> Awaited {
        self.0.clone()
    }
}

impl Drop for Waiting {
    fn drop(&mut self) {
        self.0.is_over.store(true, Ordering::Relaxed);
    }
}

impl Awaited {
    /// Whether no client waits for the answer any more.
    pub fn is_over(&self) -> bool {
        self.is_over.load(Ordering::Relaxed)
    }

    /// Returns if the client still waits for the answer. Otherwise the work unwinds with the payload
    /// [`Abandoned`], which frees all that it holds and is no fault. The panic hook is not called.
    pub fn go_on(&self) {
        if self.is_over() {
            resume_unwind(Box::new(Abandoned));
        }
    }
}

#[cfg(test)]
mod tests {
    use std::panic::catch_unwind;

    use super::*;

    #[test]
    fn work_ends_when_nobody_waits_and_not_before() {
        let waiting = Waiting::default();
        let awaited = waiting.awaited();
        awaited.go_on();
        drop(waiting);
        let ended = catch_unwind(|| awaited.go_on()).unwrap_err();
        assert!(ended.is::<Abandoned>());
    }
}
