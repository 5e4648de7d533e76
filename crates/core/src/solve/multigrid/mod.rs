//! A solver without a factor: conjugate gradients, preconditioned by smoothed aggregation.
//!
//! Nodes are gathered into aggregates, whose rigid motions are the unknowns of a coarser system, and
//! so on until the system is small. What the coarse systems cannot see is smoothed on the finer
//! ones. The hierarchy is in single precision, residuals and conjugate directions are in double. Several
//! right-hand sides share every pass over matrix and hierarchy.
//!
//! Every parallel loop writes to places of its own and every sum has a fixed order, so any number of
//! threads gives the same bits.
//!
//! Source: Vaněk, Mandel, Brezina 1996.

mod aggregates;
mod block_rows;
mod chebyshev;
mod conjugate;
mod galerkin;
mod hierarchy;
mod level;
mod motions;
mod small;
#[cfg(test)]
mod tests;

pub(super) use conjugate::{Goal, Outcome, TOGETHER, inverse_to_a_digit, solve, solve_columns};
pub(super) use hierarchy::Hierarchy;
