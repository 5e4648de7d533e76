//! Hyperelastic elements: energy, forces and tangent of a body at any deformation, which may yield.

mod averaged_volume;
mod body;
mod connectivity;
mod deformed;
mod elements;
mod groups;
mod lanes;
mod law;
mod material_work;
mod place_work;
mod plastic;
mod principal;
mod shrink;
mod states;
mod step_limit;
mod summary;
mod tangent;
mod yielding;

pub use body::Evaluated;
pub use deformed::Deformed;
pub use elements::Elements;
pub use law::{Law, Moduli, TangentCoefficients, UnknownLaw};
pub use material_work::{ForcesOf, MaterialSlope, ModuliWork};
pub use place_work::PlaceWork;
pub use principal::Curvature;
pub use summary::LargeSummary;
pub use yielding::YieldError;
