//! Pools of exact size, and the sizes that are measured.

use crate::report_error::ReportError;

/// Processors this process may use.
pub fn processors() -> usize {
    std::thread::available_parallelism().map_or(1, usize::from)
}

/// A rayon pool of exactly so many threads.
///
/// # Errors
/// [`ReportError::Threads`].
pub fn pool(threads: usize) -> Result<rayon::ThreadPool, ReportError> {
    rayon::ThreadPoolBuilder::new()
        .num_threads(threads)
        .build()
        .map_err(|source| ReportError::Threads { threads, source })
}

/// Thread counts from 1 to all: every one up to eight, then doubling.
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
