//! Report `collision`: the sphere tree against parry3d's tree of boxes, and against brute force.

mod brute;
mod felt;
mod hand_poses;
mod peer;
mod report;
mod rounds;
mod skin;

pub use report::measure;
