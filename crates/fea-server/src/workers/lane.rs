//! Lane for work of one size: some pieces at a time, each on a pool of its own, in fair turns.

use std::sync::Arc;

use tokio::sync::{Semaphore, oneshot};

use super::fair_queue::{FairQueue, Turn};
use super::pool::pool;
use super::pool::{EndedAbnormally, caught};
use crate::lock::Lock;

/// Queue of work of one size, and the pools that do it.
///
/// Each piece has a pool to itself until it ends. On a pool that several pieces shared, a thread that
/// waits inside a parallel loop would take up another piece, and the first would lie beneath it.
///
/// Invariant: pieces that wait or run ≤ `depth`; one more waits in its own session, which reads no
/// further message.
#[derive(Clone)]
pub(super) struct Lane {
    state: Arc<Lock<State>>,
    places: Arc<Semaphore>,
    depth: usize,
    /// Whether freed memory is given back to the system after each piece.
    gives_back: bool,
}

struct State {
    waiting: FairQueue<Work>,
    /// Pools without work.
    idle: Vec<Arc<rayon::ThreadPool>>,
}

type Work = Box<dyn FnOnce() + Send>;

/// Number of pieces of work that a lane does at a time, and of threads for each.
#[derive(Clone, Copy, Debug)]
pub(super) struct Width {
    pub at_once: usize,
    pub threads: usize,
    /// Nice value of the threads.
    pub niceness: i32,
    /// Whether the pieces are so large that freed memory is given back to the system after each.
    pub gives_back: bool,
}

impl Lane {
    /// Lane without work.
    ///
    /// # Errors
    /// Error of the operating system if it starts no threads.
    pub fn new(name: &str, width: Width, depth: usize) -> std::io::Result<Self> {
        let Width { at_once, threads, niceness, gives_back } = width;
        let idle: std::io::Result<Vec<_>> = (0..at_once)
            .map(|i| pool(format!("{name}{i}"), threads, niceness).map(Arc::new))
            .collect();
        let state = State { waiting: FairQueue::new(), idle: idle? };
        let places = Arc::new(Semaphore::new(depth));
        Ok(Self { state: Arc::new(Lock::new(state)), places, depth, gives_back })
    }

    /// Number of pieces that wait or are worked on.
    pub fn queued(&self) -> usize {
        self.depth - self.places.available_permits()
    }

    /// Runs `work` in its turn and waits for it without blocking the sockets. Work whose session has gone
    /// before its turn is not begun.
    ///
    /// # Errors
    /// [`EndedAbnormally`] if the work panicked; the pool lives on.
    pub async fn run<T: Send + 'static>(
        &self,
        turn: Turn,
        work: impl FnOnce() -> T + Send + 'static,
    ) -> Result<T, EndedAbnormally> {
        let place = Arc::clone(&self.places).acquire_owned().await.map_err(|_| EndedAbnormally)?;
        let (sender, receiver) = oneshot::channel();
        let work = move || {
            if sender.is_closed() {
                tracing::info!("work is not begun, because its session has gone");
                return;
            }
            let outcome = caught("on a request", work);
            drop(place);
            // The session may have gone in the meantime; then nobody waits for this.
            let _ = sender.send(outcome);
        };
        self.state.with(|state| state.waiting.push(turn, Box::new(work)));
        self.begin_next();
        receiver.await.unwrap_or(Err(EndedAbnormally))
    }

    /// Begins the next piece, if a pool is idle.
    fn begin_next(&self) {
        let next = self.state.with(|state| {
            let pool = state.idle.pop()?;
            match state.waiting.pop() {
                Some(work) => Some((pool, work)),
                None => {
                    state.idle.push(pool);
                    None
                }
            }
        });
        let Some((pool, work)) = next else { return };
        let (lane, at) = (self.clone(), Arc::clone(&pool));
        pool.spawn(move || {
            // What can panic is caught inside; a pool that was not given back would be lost.
            let _ = caught("in a lane", work);
            if lane.gives_back {
                softgrasp_os::give_back_freed_memory();
            }
            lane.state.with(|state| state.idle.push(at));
            lane.begin_next();
        });
    }
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::{AtomicBool, Ordering};
    use std::task::{Context, Waker};

    use super::super::fair_queue::Asker;
    use super::*;

    fn lane(at_once: usize) -> Lane {
        Lane::new("test", Width { at_once, threads: 1, niceness: 0, gives_back: true }, 8).unwrap()
    }

    fn turn(cost_ms: f64) -> Turn {
        Turn { asker: Asker::new(), cost_ms }
    }

    fn is_pending<F: Future>(future: &mut std::pin::Pin<Box<F>>) -> bool {
        future.as_mut().poll(&mut Context::from_waker(Waker::noop())).is_pending()
    }

    #[tokio::test]
    async fn panic_in_one_request_is_answered_and_the_pool_lives_on() {
        let lane = lane(1);
        let broken: Result<(), _> = lane.run(turn(1.0), || panic!("a fault")).await;
        assert_eq!(broken, Err(EndedAbnormally));
        assert_eq!(lane.run(turn(1.0), || 7).await, Ok(7));
    }

    #[tokio::test]
    async fn work_whose_session_has_gone_is_not_begun() {
        let lane = lane(1);
        let (gate, passed) = std::sync::mpsc::channel::<()>();
        let begun = Arc::new(AtomicBool::new(false));
        let marks = Arc::clone(&begun);
        let mut first = Box::pin(lane.run(turn(1.0), move || passed.recv()));
        let mut second =
            Box::pin(lane.run(turn(1.0), move || marks.store(true, Ordering::Relaxed)));
        // Both are in the queue, and the only pool waits at the gate.
        assert!(is_pending(&mut first) && is_pending(&mut second));
        drop(second);
        gate.send(()).unwrap();
        first.await.unwrap().unwrap();
        // One pool works in turns: by now the second had its own.
        lane.run(turn(1.0), || ()).await.unwrap();
        assert!(!begun.load(Ordering::Relaxed));
        assert_eq!(lane.queued(), 0);
    }

    #[tokio::test]
    async fn a_newcomers_small_work_is_next_however_much_costly_work_waits() {
        let lane = lane(1);
        let (gate, passed) = std::sync::mpsc::channel::<()>();
        let order = Arc::new(Lock::new(Vec::new()));
        let noted = |name: &'static str| {
            let order = Arc::clone(&order);
            move || order.with(|order| order.push(name))
        };
        let mut running = Box::pin(lane.run(turn(1.0), move || passed.recv()));
        assert!(is_pending(&mut running));
        let mut waiting: Vec<_> =
            (0..4).map(|_| Box::pin(lane.run(turn(1000.0), noted("costly")))).collect();
        assert!(waiting.iter_mut().all(is_pending));
        let mut newcomer = Box::pin(lane.run(turn(40.0), noted("newcomer")));
        assert!(is_pending(&mut newcomer));
        gate.send(()).unwrap();
        newcomer.await.unwrap();
        for work in waiting {
            work.await.unwrap();
        }
        assert_eq!(order.with(|order| order.clone())[..2], ["newcomer", "costly"]);
    }

    #[tokio::test]
    async fn work_does_not_lie_beneath_other_work_of_its_lane() {
        // The first waits inside a parallel loop for what only the second can give. On one pool that
        // both shared, the second would run on top of the first or behind it.
        let lane = lane(2);
        let (give, taken) = std::sync::mpsc::channel::<()>();
        let first = lane.run(turn(1.0), move || {
            let taken = Lock::new(taken);
            rayon::join(|| taken.with(|taken| taken.recv().is_ok()), || ()).0
        });
        let second = lane.run(turn(1.0), move || give.send(()).is_ok());
        assert_eq!(tokio::join!(first, second), (Ok(true), Ok(true)));
    }
}
