//! Lets the calling thread stand back behind others of its process where a system can weigh threads.

/// Asks the system to give the calling thread a smaller share of a processor that others want too, by so
/// many steps of nice (0 to 19); alone it runs as fast as any. Threads that it starts inherit it.
///
/// On Linux a thread has a niceness of its own. Elsewhere this does nothing: there it belongs to the
/// whole process.
#[cfg(target_os = "linux")]
pub fn stand_back(steps: i32) {
    use nix::libc::{PRIO_PROCESS, setpriority};
    // SAFETY: the call takes plain numbers; 0 is the calling thread. Standing back is always allowed, so
    // there is no failure to tell of.
    let _ = unsafe { setpriority(PRIO_PROCESS, 0, steps.clamp(0, 19)) };
}

/// Does nothing on this system.
#[cfg(not(target_os = "linux"))]
pub fn stand_back(_steps: i32) {}

#[cfg(all(test, target_os = "linux"))]
mod tests {
    use super::*;

    #[test]
    fn only_the_calling_thread_stands_back() {
        use nix::libc::{PRIO_PROCESS, getpriority};
        // SAFETY: the call takes plain numbers; 0 is the calling thread.
        let niceness = || unsafe { getpriority(PRIO_PROCESS, 0) };
        let before = niceness();
        let on_its_own = std::thread::spawn(move || {
            stand_back(7);
            niceness()
        });
        assert_eq!(on_its_own.join().expect("it does not panic"), before.max(7));
        assert_eq!(niceness(), before);
    }
}
