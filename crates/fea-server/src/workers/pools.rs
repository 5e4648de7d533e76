//! Pools of a server: one for frame questions, a lane for requests of each size, and one with lower
//! priority for background work.

use std::sync::{Arc, mpsc};

use tokio::sync::{Semaphore, oneshot};

use super::fair_queue::Turn;
use super::lane::{Lane, Width};
use super::pool::pool;
use super::pool::{EndedAbnormally, caught};

/// The pools, each behind a bounded queue.
///
/// A lane takes work up to a predicted cost, so costly work cannot fill the lane of cheap work, and the
/// system's scheduler shares the processors among the lanes.
///
/// Invariant: no work begins on a thread that holds a [`crate::lock::Lock`].
#[derive(Clone)]
pub(crate) struct Workers {
    threads: usize,
    frames: Frames,
    small: Lane,
    middle: Lane,
    long: Lane,
    background: Background,
    beside: mpsc::Sender<Task>,
    factors: Arc<rayon::ThreadPool>,
}

/// Pool for frame questions whose data is kept.
#[derive(Clone)]
struct Frames {
    pool: Arc<rayon::ThreadPool>,
    places: Arc<Semaphore>,
    depth: usize,
}

/// Pool for background work.
#[derive(Clone)]
struct Background {
    pool: Arc<rayon::ThreadPool>,
    places: Arc<Semaphore>,
}

/// Work for the thread beside the frames.
type Task = Box<dyn FnOnce() + Send>;

/// Predicted cost in ms up to which work is small: an upload of a few thousand nodes, a new contact.
pub(crate) const SMALL_MS_MAX: f64 = 250.0;
/// Predicted cost in ms up to which work is of middle length.
pub(crate) const MIDDLE_MS_MAX: f64 = 5000.0;
/// Largest number of background tasks that wait or run.
const BACKGROUND_MAX: usize = 8;
/// Nice values of threads; one step is worth a quarter of a share of the processor.
const NICENESS_MIDDLE: i32 = 3;
const NICENESS_LONG: i32 = 5;
const NICENESS_BACKGROUND: i32 = 10;

impl Workers {
    /// Pools of exactly `threads` threads for each piece of work, with queues of `queue_depth` requests.
    ///
    /// # Errors
    /// Error of the operating system if it starts no threads.
    pub fn new(threads: usize, queue_depth: usize) -> std::io::Result<Self> {
        let lane = |name, at_once, niceness| {
            let gives_back = niceness > 0;
            Lane::new(name, Width { at_once, threads, niceness, gives_back }, queue_depth)
        };
        Ok(Self {
            threads,
            frames: Frames {
                pool: Arc::new(pool("frames".to_owned(), threads, 0)?),
                places: Arc::new(Semaphore::new(queue_depth)),
                depth: queue_depth,
            },
            small: lane("small", (threads / 4).clamp(2, 8), 0)?,
            middle: lane("middle", 1 + threads / 8, NICENESS_MIDDLE)?,
            long: lane("long", 1, NICENESS_LONG)?,
            background: Background {
                pool: Arc::new(pool("background".to_owned(), threads, NICENESS_BACKGROUND)?),
                places: Arc::new(Semaphore::new(BACKGROUND_MAX)),
            },
            beside: start_beside()?,
            factors: Arc::new(pool("factors".to_owned(), 1, 0)?),
        })
    }

    /// Number of threads for one piece of work.
    pub fn threads(&self) -> usize {
        self.threads
    }

    /// Runs `work` in the background; no request waits for it. Drops it if too many tasks wait: hints and
    /// proofs are not needed for an answer.
    pub fn in_background(&self, work: impl FnOnce() + Send + 'static) {
        let Ok(place) = Arc::clone(&self.background.places).try_acquire_owned() else {
            tracing::debug!("a background task is dropped");
            return;
        };
        self.background.pool.spawn(move || {
            let _ = caught("in the background", work);
            drop(place);
        });
    }

    /// Makes a factor on a thread of its own, one after the other, while frame questions are answered
    /// with the older one: on the pool they would wait behind its pieces.
    pub fn factor_beside(&self, work: impl FnOnce() + Send + 'static) {
        self.factors.spawn(move || {
            let _ = caught("on a factor beside the frames", work);
        });
    }

    /// Runs `work` on a thread of its own, one piece after the other. For work that sleeps most of the
    /// time ([`super::Rest`]) and must keep neither the pool nor a core from frame questions.
    pub fn beside(&self, work: impl FnOnce() + Send + 'static) {
        if self.beside.send(Box::new(work)).is_err() {
            tracing::error!("the thread beside the frames has ended");
        }
    }

    /// Number of requests that wait or are worked on.
    pub fn queued(&self) -> usize {
        let frames = self.frames.depth - self.frames.places.available_permits();
        frames + [&self.small, &self.middle, &self.long].map(Lane::queued).iter().sum::<usize>()
    }

    /// Runs `work` in the lane of its predicted cost, in its turn, and waits for it without blocking the
    /// sockets. Work whose session has gone before its turn is not begun.
    ///
    /// # Errors
    /// [`EndedAbnormally`] if the work panicked; the pool lives on.
    pub async fn run<T: Send + 'static>(
        &self,
        turn: Turn,
        work: impl FnOnce() -> T + Send + 'static,
    ) -> Result<T, EndedAbnormally> {
        let lane = match turn.cost_ms {
            ..=SMALL_MS_MAX => &self.small,
            ..=MIDDLE_MS_MAX => &self.middle,
            _ => &self.long,
        };
        lane.run(turn, work).await
    }

    /// Runs a frame question whose data is kept, on threads that no other work uses.
    ///
    /// # Errors
    /// The same as those of [`Workers::run`].
    pub async fn run_frame<T: Send + 'static>(
        &self,
        work: impl FnOnce() -> T + Send + 'static,
    ) -> Result<T, EndedAbnormally> {
        let places = Arc::clone(&self.frames.places);
        let place = places.acquire_owned().await.map_err(|_| EndedAbnormally)?;
        let (sender, receiver) = oneshot::channel();
        self.frames.pool.spawn(move || {
            if sender.is_closed() {
                tracing::info!("a frame is not begun, because its session has gone");
                return;
            }
            let outcome = caught("on a frame", work);
            drop(place);
            // The session may have gone in the meantime; then nobody waits for this.
            let _ = sender.send(outcome);
        });
        receiver.await.unwrap_or(Err(EndedAbnormally))
    }

    /// Runs `work` at once on the calling thread of the sockets: for work that takes less time than
    /// handing it over, and that must not wait behind a factor.
    ///
    /// # Errors
    /// [`EndedAbnormally`] if the work panicked.
    pub fn run_here<T>(work: impl FnOnce() -> T) -> Result<T, EndedAbnormally> {
        caught("on a small frame", work)
    }
}

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

#[cfg(test)]
mod tests {
    use std::task::{Context, Waker};

    use super::super::fair_queue::Asker;
    use super::*;

    fn turn(cost_ms: f64) -> Turn {
        Turn { asker: Asker::new(), cost_ms }
    }

    fn is_pending<F: Future>(future: &mut std::pin::Pin<Box<F>>) -> bool {
        future.as_mut().poll(&mut Context::from_waker(Waker::noop())).is_pending()
    }

    #[tokio::test]
    async fn panic_on_the_sockets_thread_is_answered() {
        let broken: Result<(), EndedAbnormally> = Workers::run_here(|| panic!("a fault"));
        assert_eq!(broken, Err(EndedAbnormally));
    }

    #[tokio::test]
    async fn a_newcomer_waits_for_none_of_the_long_solves_however_many_there_are() {
        let workers = Workers::new(1, 8).unwrap();
        let costs = [f64::INFINITY, 60_000.0, 60_000.0, 1000.0, 1000.0, 1000.0];
        let (gates, works): (Vec<_>, Vec<_>) = costs
            .iter()
            .map(|&cost_ms| {
                let (gate, passed) = mpsc::channel::<()>();
                (gate, Box::pin(workers.run(turn(cost_ms), move || passed.recv().is_ok())))
            })
            .unzip();
        let mut works = works;
        assert!(works.iter_mut().all(is_pending), "none of them comes to an end by itself");
        // None of these would come back from a pool that the long ones fill.
        assert_eq!(workers.run(turn(40.0), || 7).await, Ok(7));
        assert_eq!(workers.run_frame(|| 8).await, Ok(8));
        assert_eq!(workers.queued(), costs.len());
        for gate in gates {
            gate.send(()).unwrap();
        }
        for work in works {
            assert_eq!(work.await, Ok(true));
        }
        assert_eq!((workers.queued(), workers.threads()), (0, 1));
    }

    #[tokio::test]
    async fn a_new_contact_does_not_wait_for_proofs_and_prefetched_columns() {
        let workers = Workers::new(1, 8).unwrap();
        let (gate, passed) = mpsc::channel::<()>();
        workers.in_background(move || {
            let _ = passed.recv();
        });
        assert_eq!(workers.run(turn(40.0), || 7).await, Ok(7));
        gate.send(()).unwrap();
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
