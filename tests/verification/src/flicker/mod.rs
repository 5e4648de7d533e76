//! Report `flicker`: noise of the devices against the hysteresis of the grasp, and what it costs.

mod noise;
mod report;
mod trial;

pub use report::measure;
