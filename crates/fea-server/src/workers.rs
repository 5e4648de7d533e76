//! Hands work from tokio to rayon pools of exact size, through bounded queues.
//!
//! There is a pool for frames on what is prepared, and one for everything that may take long. A thread
//! of a pool that waits inside a parallel loop takes what else waits in that pool; a frame in the same
//! pool would lie beneath a factor, or wait until all pieces of the factor are done. With pools of their
//! own, frames share the processors with the long work in the slices of the system's scheduler.

use std::panic::AssertUnwindSafe;
use std::sync::{Arc, mpsc};
use std::time::Instant;

use tokio::sync::{Semaphore, oneshot};

use crate::awaited::Abandoned;
use crate::lock::assert_none_is_held;

/// The pools, each behind a bounded queue.
///
/// Invariant: requests waiting or running in each pool ≤ `queue_depth`; one more waits in its own
/// session, which reads no further message, so TCP slows a client that asks faster than it is answered.
///
/// Invariant: no work begins on a thread that holds a [`crate::lock::Lock`].
#[derive(Clone)]
pub(crate) struct Workers {
    long: Queue,
    frames: Queue,
    background: Arc<Semaphore>,
    beside: mpsc::Sender<Task>,
    factors: Arc<rayon::ThreadPool>,
}

/// A pool and the places in its queue.
#[derive(Clone)]
struct Queue {
    pool: Arc<rayon::ThreadPool>,
    places: Arc<Semaphore>,
    depth: usize,
}

/// Work for the thread beside the frames.
type Task = Box<dyn FnOnce() + Send>;

/// The work on a request panicked, or the server stopped before it began; it has been logged.
#[derive(Debug, PartialEq, Eq, thiserror::Error)]
#[error("the work on this request ended abnormally")]
pub(crate) struct EndedAbnormally;

/// Background tasks that may wait or run at once.
const BACKGROUND_MAX: usize = 8;

impl Workers {
    /// Pools of exactly `threads` threads, with queues of so many requests.
    ///
    /// # Errors
    /// The system's, when it gives no threads.
    pub fn new(threads: usize, queue_depth: usize) -> std::io::Result<Self> {
        Ok(Self {
            long: Queue::new("solve", threads, queue_depth)?,
            frames: Queue::new("frames", threads, queue_depth)?,
            background: Arc::new(Semaphore::new(BACKGROUND_MAX)),
            beside: start_beside()?,
            factors: Arc::new(pool("factors", 1)?),
        })
    }

    /// Number of threads.
    pub fn threads(&self) -> usize {
        self.long.pool.current_num_threads()
    }

    /// Runs `work` on the pool when a thread is free; nobody waits for it. What is over the bound is
    /// dropped: this is for hints and for proofs, without which everything still works.
    pub fn in_background(&self, work: impl FnOnce() + Send + 'static) {
        let Ok(place) = Arc::clone(&self.background).try_acquire_owned() else {
            tracing::debug!("a background task is dropped");
            return;
        };
        self.long.pool.spawn(move || {
            let _ = caught("in the background", work);
            drop(place);
        });
    }

    /// Makes a factor on a thread of its own, one after the other, while frames go on with the older
    /// one: on the pool they would wait behind its pieces.
    pub fn factor_beside(&self, work: impl FnOnce() + Send + 'static) {
        self.factors.spawn(move || {
            let _ = caught("on a factor beside the frames", work);
        });
    }

    /// Runs `work` on a thread of its own, one such after the other. For what rests most of the time
    /// ([`Rest`]) and must keep neither the pool nor a core from the frames.
    pub fn beside(&self, work: impl FnOnce() + Send + 'static) {
        if self.beside.send(Box::new(work)).is_err() {
            tracing::error!("the thread beside the frames has ended");
        }
    }

    /// Requests that wait or are worked on in both pools.
    pub fn queued(&self) -> usize {
        [&self.long, &self.frames]
            .map(|queue| queue.depth - queue.places.available_permits())
            .iter()
            .sum()
    }

    /// Runs `work` that may take long and waits for it without blocking the sockets. Work whose session
    /// has gone before its turn is not begun.
    ///
    /// # Errors
    /// [`EndedAbnormally`] if the work panicked; the pool lives on.
    pub async fn run<T: Send + 'static>(
        &self,
        work: impl FnOnce() -> T + Send + 'static,
    ) -> Result<T, EndedAbnormally> {
        self.long.run("on a request", work).await
    }

    /// The same for a frame on what is prepared.
    ///
    /// # Errors
    /// As [`Workers::run`].
    pub async fn run_frame<T: Send + 'static>(
        &self,
        work: impl FnOnce() -> T + Send + 'static,
    ) -> Result<T, EndedAbnormally> {
        self.frames.run("on a frame", work).await
    }

    /// Does `work` at once on the calling thread of the sockets: for work that takes less time than
    /// handing it over, and that must not wait behind a factor either.
    ///
    /// # Errors
    /// [`EndedAbnormally`] if the work panicked.
    pub fn run_here<T>(work: impl FnOnce() -> T) -> Result<T, EndedAbnormally> {
        caught("on a small frame", work)
    }
}

impl Queue {
    fn new(name: &'static str, threads: usize, depth: usize) -> std::io::Result<Self> {
        let places = Arc::new(Semaphore::new(depth));
        Ok(Self { pool: Arc::new(pool(name, threads)?), places, depth })
    }

    async fn run<T: Send + 'static>(
        &self,
        place: &'static str,
        work: impl FnOnce() -> T + Send + 'static,
    ) -> Result<T, EndedAbnormally> {
        let taken = Arc::clone(&self.places).acquire_owned().await.map_err(|_| EndedAbnormally)?;
        let (sender, receiver) = oneshot::channel();
        self.pool.spawn(move || {
            if sender.is_closed() {
                tracing::info!("work is not begun, because its session has gone");
                return;
            }
            let outcome = caught(place, work);
            drop(taken);
            // The session may have gone in the meantime; then nobody waits for this.
            let _ = sender.send(outcome);
        });
        receiver.await.unwrap_or(Err(EndedAbnormally))
    }
}

fn pool(name: &'static str, threads: usize) -> std::io::Result<rayon::ThreadPool> {
    rayon::ThreadPoolBuilder::new()
        .num_threads(threads)
        .thread_name(move |i| format!("{name}-{i}"))
        .stack_size(STACK_BYTES)
        .build()
        .map_err(std::io::Error::other)
}

/// A thread that waits in a parallel loop takes other requests from the queue, each on top of the
/// last on one stack.
const STACK_BYTES: usize = 16 << 20;

/// Starts the thread beside the frames; it ends when the last [`Workers`] has gone.
fn start_beside() -> std::io::Result<mpsc::Sender<Task>> {
    let (sender, tasks) = mpsc::channel::<Task>();
    std::thread::Builder::new().name("beside".to_owned()).spawn(move || {
        for work in tasks {
            let _ = caught("beside the frames", work);
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

/// The result of `work`; a panic is logged.
fn caught<T>(place: &str, work: impl FnOnce() -> T) -> Result<T, EndedAbnormally> {
    let checked = || {
        assert_none_is_held();
        work()
    };
    std::panic::catch_unwind(AssertUnwindSafe(checked)).map_err(|panic| {
        if panic.is::<Abandoned>() {
            tracing::info!("work {place} is ended, because its session has gone");
            return EndedAbnormally;
        }
        let text = panic
            .downcast_ref::<String>()
            .map(String::as_str)
            .or_else(|| panic.downcast_ref::<&str>().copied())
            .unwrap_or("no text");
        tracing::error!(panic = text, "work {place} ended abnormally");
        EndedAbnormally
    })
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::{AtomicBool, Ordering};
    use std::task::{Context, Waker};

    use super::*;

    #[tokio::test]
    async fn panic_in_one_request_is_answered_and_the_pool_lives_on() {
        let workers = Workers::new(1, 8).unwrap();
        let broken: Result<(), EndedAbnormally> = workers.run(|| panic!("a fault")).await;
        assert_eq!(broken, Err(EndedAbnormally));
        let broken: Result<(), EndedAbnormally> = Workers::run_here(|| panic!("a fault"));
        assert_eq!(broken, Err(EndedAbnormally));
        assert_eq!(workers.run(|| 7).await, Ok(7));
        assert_eq!(workers.threads(), 1);
    }

    #[tokio::test]
    async fn work_whose_session_has_gone_is_not_begun() {
        let workers = Workers::new(1, 8).unwrap();
        let (gate, passed) = std::sync::mpsc::channel::<()>();
        let first = workers.run(move || passed.recv());
        let begun = Arc::new(AtomicBool::new(false));
        let marks = Arc::clone(&begun);
        let second = workers.run(move || marks.store(true, Ordering::Relaxed));
        let (mut first, mut second) = (Box::pin(first), Box::pin(second));
        // Both are in the queue, and the only thread waits at the gate.
        assert!(first.as_mut().poll(&mut Context::from_waker(Waker::noop())).is_pending());
        assert!(second.as_mut().poll(&mut Context::from_waker(Waker::noop())).is_pending());
        drop(second);
        gate.send(()).unwrap();
        first.await.unwrap().unwrap();
        // One thread works in order: by now the second had its turn.
        workers.run(|| ()).await.unwrap();
        assert!(!begun.load(Ordering::Relaxed));
        assert_eq!(workers.queued(), 0);
    }

    #[tokio::test]
    async fn frame_does_not_wait_for_long_work() {
        let workers = Workers::new(1, 8).unwrap();
        let (gate, passed) = std::sync::mpsc::channel::<()>();
        let mut long = Box::pin(workers.run(move || passed.recv()));
        assert!(long.as_mut().poll(&mut Context::from_waker(Waker::noop())).is_pending());
        // It would never come back from the same pool.
        assert_eq!(workers.run_frame(|| 7).await, Ok(7));
        gate.send(()).unwrap();
        long.await.unwrap().unwrap();
    }

    #[tokio::test]
    async fn panic_beside_the_frames_does_not_end_their_thread() {
        let workers = Workers::new(1, 8).unwrap();
        workers.beside(|| panic!("a fault"));
        let (sender, receiver) = oneshot::channel();
        workers.beside(move || sender.send(5).unwrap());
        assert_eq!(receiver.await, Ok(5));
    }
}
