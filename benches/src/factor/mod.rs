//! Report `factor`: the factor over fronts against the machine's own matrix product.

mod product;
mod report;
mod round;

pub use report::measure;
