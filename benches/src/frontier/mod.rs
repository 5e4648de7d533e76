//! Report `frontier`: time against error, for every method, precision and element.

mod contest;
mod figure;
mod object;
mod pads;
mod pareto;
mod report;
mod row;
mod system;

pub use report::measure;
