//! Faults, limits, crowds and restarts: the server keeps answering right, and gives back what it took.

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
