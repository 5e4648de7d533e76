//! Asks the system for real-time scheduling of the calling thread, and gives it back.

use std::io;

use thread_priority::Error;

/// The system does not schedule this thread before others; it works as well, but is late more often.
#[derive(Debug, thiserror::Error)]
#[error("no real-time scheduling ({0}); on Linux it takes CAP_SYS_NICE or a limit `rtprio`")]
pub struct NotUrgent(io::Error);

/// Asks the system to run the calling thread, whenever it has something to do, before all threads
/// without this right. For threads that rest most of the time and start no others (which would
/// inherit it).
///
/// # Errors
/// [`NotUrgent`] where it is not allowed; nothing has changed then.
pub fn be_urgent() -> Result<(), NotUrgent> {
    raise().map_err(|error| {
        NotUrgent(match error {
            Error::OS(code) => io::Error::from_raw_os_error(code),
            other => io::Error::other(format!("{other:?}")),
        })
    })
}

/// Gives the right of [`be_urgent`] back: the calling thread is scheduled like any other. For work
/// that takes longer than a millisecond. Does nothing on a thread that never had the right.
pub fn be_ordinary() {
    lower();
}

/// Gives the calling thread the lowest real-time priority, which is above all ordinary priorities.
#[cfg(unix)]
fn raise() -> Result<(), Error> {
    use thread_priority::{
        RealtimeThreadSchedulePolicy, ThreadPriority, ThreadSchedulePolicy,
        set_thread_priority_and_policy, thread_native_id,
    };
    let policy = ThreadSchedulePolicy::Realtime(RealtimeThreadSchedulePolicy::RoundRobin);
    set_thread_priority_and_policy(thread_native_id(), ThreadPriority::Min, policy)
}

#[cfg(not(unix))]
fn raise() -> Result<(), Error> {
    thread_priority::set_current_thread_priority(thread_priority::ThreadPriority::Max)
}

#[cfg(unix)]
fn lower() {
    use nix::libc::{SCHED_OTHER, pthread_self, pthread_setschedparam, sched_param};
    // SAFETY: `sched_param` holds plain integers, for which all zeros is a value.
    let mut ordinary: sched_param = unsafe { std::mem::zeroed() };
    ordinary.sched_priority = 0;
    // SAFETY: the calling thread exists while it calls, and `ordinary` outlives the call. A thread
    // may always lower itself, so there is no failure to tell of.
    let _ = unsafe { pthread_setschedparam(pthread_self(), SCHED_OTHER, &raw const ordinary) };
}

#[cfg(not(unix))]
fn lower() {
    // A thread that keeps its priority still does the same work.
    let _ = thread_priority::set_current_thread_priority(
        thread_priority::ThreadPriority::Crossplatform(
            thread_priority::ThreadPriorityValue::default(),
        ),
    );
}

#[cfg(all(test, unix))]
mod tests {
    use super::*;

    #[test]
    fn thread_that_gives_the_right_back_is_scheduled_like_any_other() {
        let policy = || thread_priority::thread_schedule_policy().ok();
        let on_its_own = std::thread::spawn(move || {
            let before = policy();
            let urgent = be_urgent().is_ok();
            let while_urgent = policy();
            be_ordinary();
            (before, urgent, while_urgent, policy())
        });
        let (before, urgent, while_urgent, after) = on_its_own.join().expect("it does not panic");
        assert_eq!(after, before);
        assert_eq!(while_urgent != before, urgent, "only where it is allowed");
    }
}
