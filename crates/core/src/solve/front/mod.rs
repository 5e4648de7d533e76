//! Parallel sparse Cholesky over the tree of fronts: analysis, factor, solves.

mod analysis;
mod assembly;
mod blocks;
mod dense;
mod etree;
mod factor;
mod kernel;
mod real;
mod runs;
mod slabs;
mod solve;
mod substitute;
mod supernodes;
#[cfg(test)]
mod tests;

pub use analysis::FrontAnalysis;
pub use factor::{FrontError, FrontFactor, FrontPrecision};
use real::Real;
