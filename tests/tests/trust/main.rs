//! Faults, limits, crowds and restarts: the server goes on to answer correctly, and gives its memory
//! back.

#![allow(
    clippy::unwrap_used,
    clippy::print_stdout,
    reason = "helpers of tests fail and speak like tests"
)]

mod abandoned;
mod drain;
mod fifty;
mod fuzzed;
mod killed;
mod limits;
mod received;
mod seeds;
#[path = "../system/start.rs"]
mod start;
