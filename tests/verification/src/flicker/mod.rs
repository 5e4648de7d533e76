//! Report `flicker`: noise of the devices against the hysteresis of the grasp, and the delay that it
//! costs.

mod noise;
mod report;
mod trial;

pub use report::measure;
