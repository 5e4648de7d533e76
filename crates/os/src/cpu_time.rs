//! Measures how long a thread has computed, without the time it slept or waited.

use std::time::Duration;

/// Time for which a processor has worked on the calling thread; `None` where the system does not
/// tell. Differences of two calls on one thread mean something, the value itself does not.
#[cfg(unix)]
pub fn thread_cpu_time() -> Option<Duration> {
    use nix::time::{ClockId, clock_gettime};
    clock_gettime(ClockId::CLOCK_THREAD_CPUTIME_ID).ok().map(Duration::from)
}

/// Always `None`: this system does not tell how long a thread has computed.
#[cfg(not(unix))]
pub fn thread_cpu_time() -> Option<Duration> {
    None
}

#[cfg(all(test, unix))]
mod tests {
    use super::*;

    #[test]
    fn time_grows_while_the_thread_computes() {
        let start = thread_cpu_time().expect("this system tells");
        let mut sum = 0_u64;
        while thread_cpu_time().expect("this system tells") == start {
            sum = std::hint::black_box(sum + 1);
        }
        assert!(thread_cpu_time().expect("this system tells") > start);
    }
}
