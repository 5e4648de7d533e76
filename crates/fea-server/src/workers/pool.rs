//! A rayon pool of exact size whose threads stand back so far.

/// A thread that waits inside a parallel loop takes other pieces, each on top of the last on one stack.
const STACK_BYTES: usize = 16 << 20;

/// A pool of exactly `threads` threads; `niceness` is how far they stand back behind others.
///
/// # Errors
/// The system's, when it gives no threads.
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
