//! The `glove-client` program as a process: what it solves, and how it fails.

#![allow(
    clippy::unwrap_used,
    clippy::print_stdout,
    reason = "helpers of tests fail and speak like tests"
)]

mod admission;
mod agreement;
mod commands;
mod discretisation;
mod interruption;
mod numbers;
mod references;
mod runs;
mod start;
