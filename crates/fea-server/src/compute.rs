//! The one place where tokio and rayon meet: a bounded queue of work for a pool of exact size.

use std::panic::AssertUnwindSafe;
use std::sync::{Arc, mpsc};
use std::time::Instant;

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
    beside: mpsc::Sender<Task>,
}

/// Work for the thread beside the frames.
type Task = Box<dyn FnOnce() + Send>;

/// Background tasks that may wait or run at once.
const BACKGROUND_MAX: usize = 8;
/// Requests of all sessions that may wait or run at once.
const QUEUE_DEPTH: usize = 32;

impl Compute {
    /// A pool of exactly `threads` threads.
    ///
    /// # Errors
    /// The system's, when it gives no threads.
    pub fn new(threads: usize) -> std::io::Result<Self> {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .thread_name(|i| format!("solve-{i}"))
            .build()
            .map_err(std::io::Error::other)?;
        Ok(Self {
            pool: Arc::new(pool),
            places: Arc::new(Semaphore::new(QUEUE_DEPTH)),
            background: Arc::new(Semaphore::new(BACKGROUND_MAX)),
            beside: start_beside()?,
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

    /// Runs `work` on a thread of its own, one such after the other. For what rests most of the time
    /// ([`Rest`]) and must keep neither the pool nor a core from the frames.
    pub fn beside(&self, work: impl FnOnce() + Send + 'static) {
        if self.beside.send(Box::new(work)).is_err() {
            tracing::error!("the thread beside the frames has ended");
        }
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

/// Starts the thread beside the frames; it ends when the last [`Compute`] has gone.
fn start_beside() -> std::io::Result<mpsc::Sender<Task>> {
    let (sender, tasks) = mpsc::channel::<Task>();
    std::thread::Builder::new().name("beside".to_owned()).spawn(move || {
        for work in tasks {
            if std::panic::catch_unwind(AssertUnwindSafe(work)).is_err() {
                tracing::error!("work beside the frames ended abnormally");
            }
        }
    })?;
    Ok(sender)
}

/// Lets a thread rest so that it works for a tenth of its time, in pieces far shorter than the
/// slices in which a system hands out its cores: nothing that is urgent ever waits for it.
pub(crate) struct Rest {
    worked_since: Instant,
}

/// Time at rest per time at work.
const REST_PER_WORK: u32 = 9;

impl Rest {
    /// Work begins.
    pub fn new() -> Self {
        Self { worked_since: Instant::now() }
    }

    /// Rests for what has been worked since the last rest.
    pub fn rest(&mut self) {
        std::thread::sleep(REST_PER_WORK * self.worked_since.elapsed());
        self.worked_since = Instant::now();
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
