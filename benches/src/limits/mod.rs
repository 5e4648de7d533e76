//! Report `limits`: rate of the factor over fronts against the largest rate of the machine.

mod one_size;
mod product;
mod report;
mod request;
mod round;
mod several;

pub use report::measure;
