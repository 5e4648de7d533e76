//! One interface to all direct methods: factor a partition once, then solve for many loads.

mod block;
mod error;
mod factored;
mod kernel;
mod one_load;
mod refinement;
mod solution;
#[cfg(test)]
mod tests;

pub use error::SolveError;
pub use factored::Factored;
pub use kernel::Analysed;
pub use solution::{Fallback, Loads, Solution};
