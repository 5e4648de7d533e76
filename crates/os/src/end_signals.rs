//! Waits, on a thread of its own, for the signals that ask a program to end.
//!
//! A library in C may take signals over while it works: METIS, which once ordered the equations,
//! answered SIGTERM by a `longjmp` on whichever thread the system gave the signal to, and a program
//! that was asked to end at such a moment crashed. A signal that every thread blocks waits for the
//! one that asks for it, whatever handler stands there.

use std::io;

/// A signal that asked the program to end.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct EndSignal {
    /// Name of the signal, for example `SIGTERM`; `Ctrl-C` where the system has no signals.
    pub name: &'static str,
    /// Exit code by which a shell knows a program that this signal ended: 128 plus the signal's number.
    pub exit_code: u8,
    /// Whether the signal is SIGHUP: its terminal was closed, or a server is asked to read its files
    /// again.
    pub is_hang_up: bool,
}

/// Calls `react`, on a thread of its own, for every signal that asks the program to end: SIGINT (Ctrl-C)
/// and SIGTERM (`docker stop`); `hang_up` adds SIGHUP (the terminal was closed).
///
/// To be called before any other thread is started: threads inherit which signals are blocked.
///
/// # Errors
/// The error of the operating system, where signals cannot be blocked or the thread cannot be started.
#[cfg(unix)]
pub fn on_end_signal(
    hang_up: bool,
    mut react: impl FnMut(EndSignal) + Send + 'static,
) -> io::Result<()> {
    use nix::sys::signal::{SigSet, Signal};
    let mut awaited = SigSet::empty();
    awaited.add(Signal::SIGINT);
    awaited.add(Signal::SIGTERM);
    if hang_up {
        awaited.add(Signal::SIGHUP);
    }
    awaited.thread_block()?;
    let wait = move || {
        // It fails for a set that holds no signal only.
        while let Ok(signal) = awaited.wait() {
            let exit_code = 128 + signal as i32 as u8;
            let is_hang_up = signal == Signal::SIGHUP;
            react(EndSignal { name: signal.as_str(), exit_code, is_hang_up });
        }
    };
    let waits = std::thread::Builder::new().name("signals".to_owned()).spawn(wait);
    if waits.is_err() {
        // Nobody waits: they are to end the program as they always did.
        awaited.thread_unblock()?;
    }
    waits.map(drop)
}

/// Calls `react`, on a thread of its own, for Ctrl-C and what the system treats like it. `_hang_up` does
/// nothing on this system.
///
/// # Errors
/// The error of the operating system, where no handler can be set.
#[cfg(not(unix))]
pub fn on_end_signal(
    _hang_up: bool,
    mut react: impl FnMut(EndSignal) + Send + 'static,
) -> io::Result<()> {
    let ctrl_c = EndSignal { name: "Ctrl-C", exit_code: 130, is_hang_up: false };
    ctrlc::set_handler(move || react(ctrl_c)).map_err(io::Error::other)
}
