//! The one place where tokio and rayon meet: a bounded queue of work for a pool of exact size.

use std::panic::AssertUnwindSafe;
use std::sync::Arc;

use tokio::sync::{Semaphore, oneshot};

use crate::reject::Refusal;

/// A rayon pool behind a bounded queue.
///
/// Invariant: requests waiting or running ≤ `QUEUE_DEPTH`; one more waits in its own session,
/// which stops reading its socket, so a client that asks faster than it is answered is slowed by
/// TCP and not by a growing queue here.
#[derive(Clone)]
pub(crate) struct Compute {
    pool: Arc<rayon::ThreadPool>,
    places: Arc<Semaphore>,
    background: Arc<Semaphore>,
}

/// Background tasks that may wait or run at once.
const BACKGROUND_MAX: usize = 8;
/// Requests of all sessions that may wait or run at once.
const QUEUE_DEPTH: usize = 32;

impl Compute {
    /// A pool of exactly `threads` threads.
    ///
    /// # Errors
    /// The system's, when it gives no threads.
    pub fn new(threads: usize) -> Result<Self, rayon::ThreadPoolBuildError> {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .thread_name(|i| format!("solve-{i}"))
            .build()?;
        Ok(Self {
            pool: Arc::new(pool),
            places: Arc::new(Semaphore::new(QUEUE_DEPTH)),
            background: Arc::new(Semaphore::new(BACKGROUND_MAX)),
        })
    }

    /// Number of threads.
    pub fn threads(&self) -> usize {
        self.pool.current_num_threads()
    }

    /// Runs `work` on the pool when it comes to it; nobody waits. What is over the bound is dropped:
    /// this is for hints and for proofs, without which everything still works.
    pub fn in_background(&self, work: impl FnOnce() + Send + 'static) {
        let Ok(place) = Arc::clone(&self.background).try_acquire_owned() else {
            tracing::debug!("a background task is dropped");
            return;
        };
        self.pool.spawn(move || {
            if std::panic::catch_unwind(AssertUnwindSafe(work)).is_err() {
                tracing::error!("work in the background ended abnormally");
            }
            drop(place);
        });
    }

    /// Runs `work` on the pool when it comes to it, whatever waits there. For one task per model that
    /// bounds itself.
    pub fn beside(&self, work: impl FnOnce() + Send + 'static) {
        self.pool.spawn(move || {
            // A panic here would end the process: nobody waits for this task.
            if std::panic::catch_unwind(AssertUnwindSafe(work)).is_err() {
                tracing::error!("work beside the frames ended abnormally");
            }
        });
    }

    /// Runs `work` on the pool and waits for it without blocking the sockets.
    ///
    /// # Errors
    /// [`Refusal::Internal`] if the work panicked; the panic is logged and the pool lives on.
    pub async fn run<T: Send + 'static>(
        &self,
        work: impl FnOnce() -> Result<T, Refusal> + Send + 'static,
    ) -> Result<T, Refusal> {
        let place =
            Arc::clone(&self.places).acquire_owned().await.map_err(|_| Refusal::Internal)?;
        let (sender, receiver) = oneshot::channel();
        self.pool.spawn(move || {
            let outcome = caught(work);
            drop(place);
            // The session may have gone in the meantime; then nobody waits for this.
            let _ = sender.send(outcome);
        });
        receiver.await.unwrap_or(Err(Refusal::Internal))
    }

    /// Does `work` at once on the calling thread of the sockets: for what is done sooner than handed
    /// over, and must not wait behind a factor either.
    ///
    /// # Errors
    /// [`Refusal::Internal`] if the work panicked; the panic is logged.
    pub fn run_here<T>(work: impl FnOnce() -> Result<T, Refusal>) -> Result<T, Refusal> {
        caught(work)
    }
}

/// What `work` comes to; a panic is logged and is the server's fault.
fn caught<T>(work: impl FnOnce() -> Result<T, Refusal>) -> Result<T, Refusal> {
    std::panic::catch_unwind(AssertUnwindSafe(work)).unwrap_or_else(|panic| {
        let text = panic
            .downcast_ref::<String>()
            .map(String::as_str)
            .or_else(|| panic.downcast_ref::<&str>().copied())
            .unwrap_or("no text");
        tracing::error!(panic = text, "work on a request ended abnormally");
        Err(Refusal::Internal)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[tokio::test]
    async fn panic_in_one_request_is_answered_and_the_pool_lives_on() {
        let compute = Compute::new(1).unwrap();
        let broken: Result<(), Refusal> = compute.run(|| panic!("a fault")).await;
        assert!(matches!(broken, Err(Refusal::Internal)));
        let broken: Result<(), Refusal> = Compute::run_here(|| panic!("a fault"));
        assert!(matches!(broken, Err(Refusal::Internal)));
        assert_eq!(compute.run(|| Ok(7)).await.unwrap(), 7);
        assert_eq!(compute.threads(), 1);
    }
}
