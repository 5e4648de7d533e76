//! Motion of a soft object among rigid bodies: weight, contact, Coulomb friction, one step at a time.
//!
//! The elastic part has no inertia and the rigid motion has: a fruit rings at tens of hertz and is damped
//! within a few periods, so a scene of grasping needs the inertia of the whole object, and not that of
//! its vibrations. A step of h seconds solves, for the contact forces λ,
//!
//! ```text
//! M (v⁺ − v) / h = w + Gᵀ λ            rigid part, implicit Euler; w the weight
//! u⁺ = (h K⁻ P Bᵀ λ + τ u) / (h + τ)   elastic part (inertia relief), viscosity τ
//! gap ≥ 0, λ_n ≥ 0, λ_n gap = 0        at the end of the step
//! ‖λ_t‖ ≤ μ λ_n, against the slip of the step
//! ```
//!
//! so that gaps and slips are `W λ + b` with `W = h/(h+τ) B C Bᵀ + h² G M⁻¹ Gᵀ`. Distances are those of
//! the true bodies: the step is repeated from where it ended until they are met.
//!
//! Source: Moreau–Jean time stepping; Kelvin and Voigt; De Saxcé and Feng (1998).

mod assemble;
mod bodies;
#[cfg(test)]
mod buckling_tests;
mod carried;
#[cfg(test)]
mod carried_tests;
mod checks;
mod configuration;
mod features;
mod large_body;
mod large_step;
#[cfg(test)]
mod large_tests;
#[cfg(test)]
mod late_tests;
#[cfg(test)]
mod law_tests;
mod near;
#[cfg(test)]
mod quadratic_tests;
mod resultants;
mod rigid_motion;
mod rolling;
#[cfg(test)]
mod rounded_box_tests;
mod rounds;
mod settings;
mod small_system;
#[cfg(test)]
mod small_system_tests;
mod state;
mod step;
#[cfg(test)]
mod tests;
#[cfg(test)]
mod yield_tests;

pub use bodies::{MovingBody, near_triangles, reach_of_step};
pub use carried::Carried;
pub use features::Candidate;
pub use large_body::LargeBody;
pub use large_step::LargeStep;
pub use rigid_motion::MassProperties;
pub use settings::{StepError, StepSettings};
pub use small_system::{BodyContact, SmallSystem};
pub use state::{BodyLoad, PointContact, StepOutcome};
pub use state::{HeldContact, ObjectState};
pub use step::ContactStep;
