//! Keeping step: which tick is due, a clock that can stand, how long a tick may compute.

pub mod run_clock;
mod schedule;
pub mod tick_budget;

pub use schedule::{Due, Pace, Schedule, be_urgent, wait_until};
