//! The `glove-client` program as a process: what it solves, and how it fails.

#![allow(
    clippy::unwrap_used,
    clippy::print_stdout,
    reason = "helpers of tests fail and speak like tests"
)]

mod admission;
mod agreement;
mod cases;
mod commands;
mod contact_runs;
mod curved;
mod devices;
mod discretisation;
mod emulator;
mod fill;
mod full_disk;
mod gradient;
mod interruption;
mod joint_runs;
mod killed_server;
mod loads;
mod numbers;
mod older_server;
#[cfg(feature = "xr")]
mod page;
mod press;
mod recordings;
mod references;
mod regions;
mod runs;
mod serial_runs;
mod start;
mod table_runs;
mod two_hand_runs;
