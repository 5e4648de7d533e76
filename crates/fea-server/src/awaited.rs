//! Whether anybody still waits for the answer to a request; its work ends where nobody does.

use std::panic::resume_unwind;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// Held by whoever waits for an answer; the work knows when it is dropped.
#[derive(Default)]
pub(crate) struct Waiting(Awaited);

/// The work's side: whether somebody waits.
#[derive(Clone, Default)]
pub(crate) struct Awaited {
    is_over: Arc<AtomicBool>,
}

/// Panic payload of work that ends because its client has gone; see [`Awaited::go_on`].
pub(crate) struct Abandoned;

impl Waiting {
    /// For the work.
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
    /// Returns if the client still waits for the answer. Otherwise the work unwinds with the payload
    /// [`Abandoned`], which gives back all that it holds and is told from a fault by whoever began it. The
    /// panic hook is not called.
    pub fn go_on(&self) {
        if self.is_over.load(Ordering::Relaxed) {
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
