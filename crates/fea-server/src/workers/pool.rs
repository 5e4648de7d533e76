//! Threads for work: a rayon pool of exact size, a panic that ends its own work only, and pauses for work
//! that must keep neither pool nor core from the frames.

use std::panic::AssertUnwindSafe;
use std::time::Instant;

use crate::awaited::Abandoned;
use crate::lock::assert_none_is_held;

/// Stack of a thread: one that waits inside a parallel loop takes other pieces on the same stack.
const STACK_BYTES: usize = 16 << 20;

/// Pool of exactly `threads` threads; `niceness` is their nice value.
///
/// # Errors
/// Error of the operating system if it starts no threads.
pub(super) fn pool(
    name: String,
    threads: usize,
    niceness: i32,
) -> std::io::Result<rayon::ThreadPool> {
    rayon::ThreadPoolBuilder::new()
        .num_threads(threads)
        .thread_name(move |i| format!("{name}-{i}"))
        .stack_size(STACK_BYTES)
        .start_handler(move |_| {
            if niceness > 0 {
                softgrasp_os::stand_back(niceness);
            }
        })
        .build()
        .map_err(std::io::Error::other)
}

/// The work on a request panicked, or the server stopped before it began; it has been logged.
#[derive(Debug, PartialEq, Eq, thiserror::Error)]
#[error("the work on this request ended abnormally")]
pub(crate) struct EndedAbnormally;

/// Result of `work`; a panic in it is logged.
///
/// # Errors
/// [`EndedAbnormally`] if it panicked.
pub(super) fn caught<T>(place: &str, work: impl FnOnce() -> T) -> Result<T, EndedAbnormally> {
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

/// Makes a thread sleep so that it works for a tenth of its time, in pieces far shorter than the time
/// slices of the system's scheduler: urgent work never waits for it.
pub(crate) struct Rest {
    worked_since: Instant,
}

/// Time asleep for each unit of time at work.
const REST_PER_WORK: u32 = 9;

impl Rest {
    /// Starts the measurement of the time at work.
    pub fn new() -> Self {
        Self { worked_since: Instant::now() }
    }

    /// Sleeps in proportion to the time at work since the last sleep.
    pub fn rest(&mut self) {
        std::thread::sleep(REST_PER_WORK * self.worked_since.elapsed());
        self.worked_since = Instant::now();
    }
}
