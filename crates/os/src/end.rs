//! Ends a program after a time limit if it has not ended by itself.

use std::time::Duration;

/// Ends the program with exit code 0 after `limit`, if it has not ended by itself by then; returns at
/// once.
///
/// For a program that was asked to end and has tidied up what it can: a thread that is at work, or one
/// that waits for something that never comes, must not keep it.
pub fn end_within(limit: Duration) {
    let waits = std::thread::Builder::new().name("end".to_owned()).spawn(move || {
        std::thread::sleep(limit);
        std::process::exit(0);
    });
    if waits.is_err() {
        std::process::exit(0);
    }
}
