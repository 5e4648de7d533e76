//! Equilibrium at large deformation: found by corrections with an older factor, followed from frame
//! to frame, and judged by its own residual.

mod adjoint;
#[cfg(test)]
mod adjoint_tests;
mod cause;
mod corrections;
mod descent;
mod find;
#[cfg(test)]
mod find_tests;
mod follow;
mod followed;
mod goal;
mod hold;
mod inverse;
#[cfg(test)]
mod live_tests;
#[cfg(test)]
mod multigrid_tests;
mod outcome;
mod path;
#[cfg(test)]
mod plastic_tests;
mod secants;
mod settle;
mod shape;
#[cfg(test)]
mod tests;

pub use adjoint::{Adjoint, AdjointLoad, NoAdjoint};
pub use goal::{Goal, Wish};
pub use hold::{Dependent, Hold, HoldOf, TangentsBy};
pub use inverse::{FactorError, Renewal, Renewed};
pub use outcome::{Equilibrium, NoEquilibrium};
pub use path::Path;
