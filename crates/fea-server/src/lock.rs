//! A mutex that is held for a look or a small change and never across parallel work.
//!
//! A thread of the solving pool that waits inside a parallel loop takes other work from the pool. If it
//! held a lock while it waits, the other work could wait for the same lock, on the same thread, for
//! ever. So a lock is held by a closure only, and work that begins on a thread which holds one is a
//! fault that says so ([`assert_none_is_held`]).

use std::cell::Cell;
use std::sync::{Mutex, PoisonError};

thread_local! {
    /// Number of locks that this thread holds.
    static HELD: Cell<usize> = const { Cell::new(0) };
}

/// Mutex whose value only closures can reach.
#[derive(Debug, Default)]
pub(crate) struct Lock<T>(Mutex<T>);

impl<T> Lock<T> {
    /// Lock that guards `value`.
    pub fn new(value: T) -> Self {
        Self(Mutex::new(value))
    }

    /// Calls `look` with the guarded value; `look` must not start parallel work.
    ///
    /// A panic in another closure does not close the lock: values are replaced whole, never in part.
    pub fn with<R>(&self, look: impl FnOnce(&mut T) -> R) -> R {
        let mut value = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let _held = Held::new();
        look(&mut value)
    }
}

/// Counts one held lock while it exists, also through a panic.
struct Held;

impl Held {
    fn new() -> Self {
        HELD.set(HELD.get() + 1);
        Self
    }
}

impl Drop for Held {
    fn drop(&mut self) {
        HELD.set(HELD.get() - 1);
    }
}

/// To be called where work begins on a thread.
///
/// # Panics
/// If the thread holds a lock: it waits in parallel work under a lock and has taken this work meanwhile.
pub(crate) fn assert_none_is_held() {
    let held = HELD.get();
    assert!(held == 0, "work begins on a thread that holds {held} locks across parallel work");
}

#[cfg(test)]
mod tests {
    use rayon::prelude::*;

    use super::*;

    #[test]
    fn work_under_a_lock_is_found_out() {
        let lock = Lock::<i32>::default();
        assert_none_is_held();
        assert_eq!(lock.with(|value| *value + 1), 1);
        assert!(std::panic::catch_unwind(|| lock.with(|_| assert_none_is_held())).is_err());
        // The panic has given the lock back.
        assert_none_is_held();
        lock.with(|value| *value = 3);
    }

    #[test]
    fn request_taken_while_a_parallel_loop_waits_under_a_lock_is_found_out() {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
        let (sender, receiver) = std::sync::mpsc::channel();
        pool.install(|| {
            let lock = Lock::<()>::default();
            rayon::spawn(move || {
                let found = std::panic::catch_unwind(assert_none_is_held).is_err();
                sender.send(found).unwrap();
            });
            // The only thread takes the request while the loop under the lock lets others pass.
            lock.with(|()| {
                (0..4).into_par_iter().for_each(|_| {
                    rayon::yield_now();
                });
            });
        });
        assert!(receiver.recv().unwrap(), "the request began under a lock and nobody noticed");
    }
}
