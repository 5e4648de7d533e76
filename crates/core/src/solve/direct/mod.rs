//! One interface to all direct methods: factor a partition once, then solve for many loads.

mod alone;
mod analysed;
mod block;
mod direction;
mod error;
mod factored;
mod fallback;
mod iterated;
mod kernel;
mod refinement;
mod several;
mod solution;
#[cfg(test)]
mod tests;

pub use analysed::Analysed;
pub use error::SolveError;
pub use factored::Factored;
pub use fallback::Fallback;
pub use solution::{Loads, Solution};
