//! Timing of ticks: which tick is due, a clock that can be stopped, and the time that a tick may compute.

pub mod run_clock;
mod schedule;
pub mod tick_budget;

pub use schedule::{Due, Pace, Schedule, be_urgent, wait_until};
