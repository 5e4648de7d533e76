//! Hyperelastic elements: energy, forces and tangent of a body at any deformation, which may yield.

mod averaged;
mod averaged_volume;
mod deformed;
mod elements;
mod groups;
mod hencky;
mod lanes;
mod law;
mod locals;
mod plastic;
mod positive_part;
mod principal;
mod principal_tangent;
mod shrink;
mod states;
mod step_limit;
mod summary;
mod tangent;
mod yielding;

pub use deformed::Deformed;
pub use elements::{Elements, Evaluated};
pub use law::{Law, Moduli, TangentCoefficients, UnknownLaw};
pub use positive_part::positive_part;
pub use summary::LargeSummary;
pub use tangent::Curvature;
pub use yielding::YieldError;
