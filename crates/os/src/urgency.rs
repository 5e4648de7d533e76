//! Threads that keep a schedule of a millisecond are scheduled before those that do not.

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

/// The least of the real-time priorities is above all that are none.
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
