//! Recordings made by others: tracker trajectories and camera-tracked hands.

mod leap;
#[cfg(test)]
mod real_data_tests;
mod traj;

pub use leap::{LeapError, LeapFrame, LeapRecording};
pub use traj::{TrajError, Trajectory};
