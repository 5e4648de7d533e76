//! Contact with Coulomb friction between points: the cone, the problem, its solution, its residual.

mod between_points;
mod cone;
mod delassus;
mod forces;
mod law;
mod newton;
mod problem;
mod solution;
mod splitting;
#[cfg(test)]
mod sweeps;

pub use cone::{FrictionCone, PointForce};
pub use delassus::{Delassus, PointPlace, ProblemError, Slide};
pub use forces::SolveBudget;
pub use law::PointLaw;
pub use problem::ContactProblem;
pub use solution::{PointState, Solution, state_of};

#[cfg(test)]
mod tests;
