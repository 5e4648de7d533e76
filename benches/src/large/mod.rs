//! Report `large`: error against time of frames at large deformation, and random walks of the hand.

mod estimates;
mod frames;
mod rates;
mod report;
mod squeeze;
mod trial;
mod trust;
mod walk;

pub use report::measure;
pub use walk::{Walk, WalkFault};
