//! Report `scale`: nodes against time and memory, by factors, by multigrid and by a cluster's worker.

mod case;
mod cube;
mod laws;
mod machines;
mod report;
mod row;
mod way;

pub use report::{measure, measure_sizes};
