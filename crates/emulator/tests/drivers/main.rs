//! The drivers against the emulators over pseudo-terminals, at real rates.

#![cfg(unix)]
#![allow(
    clippy::unwrap_used,
    clippy::print_stdout,
    reason = "helpers of tests fail and speak like tests"
)]

mod completeness;
mod probing;
mod reader;
mod recovery;
mod served;
