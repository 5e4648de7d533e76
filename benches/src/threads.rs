//! Pools of exact size, and the numbers of threads that are measured.

use crate::report_error::ReportError;

/// Number of processors that this process may use.
pub fn processors() -> usize {
    std::thread::available_parallelism().map_or(1, usize::from)
}

/// Rayon pool of exactly `threads` threads.
///
/// # Errors
/// [`ReportError::Threads`] if they cannot be started.
pub fn pool(threads: usize) -> Result<rayon::ThreadPool, ReportError> {
    rayon::ThreadPoolBuilder::new()
        .num_threads(threads)
        .build()
        .map_err(|source| ReportError::Threads { threads, source })
}

/// Numbers of threads from 1 to all: every one up to eight, then doubling.
pub fn thread_counts(all: usize) -> Vec<usize> {
    let mut counts: Vec<usize> = (1..=all.min(8)).collect();
    let mut next = 16;
    while next < all {
        counts.push(next);
        next *= 2;
    }
    counts.extend((all > 8).then_some(all));
    counts
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn counts_begin_with_one_and_end_with_all() {
        assert_eq!(thread_counts(1), [1]);
        assert_eq!(thread_counts(4), [1, 2, 3, 4]);
        assert_eq!(thread_counts(16), [1, 2, 3, 4, 5, 6, 7, 8, 16]);
        assert_eq!(thread_counts(40)[7..], [8, 16, 32, 40]);
    }

    #[test]
    fn pool_has_exactly_as_many_threads_as_asked_for() {
        assert_eq!(pool(3).unwrap().install(rayon::current_num_threads), 3);
    }
}
