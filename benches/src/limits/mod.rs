//! Report `limits`: the factor over fronts against what the machine can do at most.

mod one_size;
mod product;
mod report;
mod request;
mod round;
mod several;

pub use report::measure;
