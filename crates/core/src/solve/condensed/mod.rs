//! `condensed`: one factor per shape, then exact answers from a few columns of the compliance.
//!
//! Lineage: condensation (Bro-Nielsen and Cotin 1996), Green's functions and capacitance matrices
//! (James and Pai 1999). A base of degrees of freedom is held once per shape and `K_B` factored
//! ([`Base`]). The response to a unit force at a node is a column of `G = K_B⁻¹`, computed when
//! the node is first touched and kept ([`Columns`]). A contact is one node, or a mask of nodes with
//! weights whose mean is held ([`Touched`]); E has a column for each of their directions, and
//! `G = K_B⁻¹ E`. For a set of contacts ([`ContactSet`]) the forces λ and the motions without energy
//! `a` follow from
//!
//! ```text
//! [ EᵀG    EᵀR ] [λ]   [ q ]
//! [ (EᵀR)ᵀ  0  ] [a] = [ 0 ]        u = G λ + R a
//! ```
//!
//! λ balances itself, so the artificial base carries nothing and `K u = E λ`, `Eᵀu = q` hold exactly;
//! for single nodes that is (3.43a), and λ are the reactions (3.43b). Nodes that the scene fixes are
//! a true base and need no R. Loads change the right side only ([`LoadedSet`]).

mod base;
#[cfg(test)]
mod bound_tests;
mod certificate;
mod columns;
mod contact_set;
mod correction;
#[cfg(test)]
mod cycles_tests;
mod error;
mod free_body;
mod free_response;
mod free_tangent;
mod held_inverse;
mod load_column;
#[cfg(test)]
mod load_tests;
mod loaded_set;
#[cfg(test)]
mod mask_tests;
mod overlap;
mod rounding;
mod small_system;
#[cfg(test)]
mod tests;
mod touched;
mod verified;

pub use base::{Base, BaseOf};
pub use certificate::{Certificate, Delivery};
pub use columns::{Columns, ContactColumns};
pub use contact_set::ContactSet;
pub use error::CondensedError;
pub use free_body::{FreeBody, Relief};
pub use free_response::{Elasticity, HeldCompliance, NodeForce, Response, ShapeResponse};
pub use free_tangent::FreeTangent;
pub use held_inverse::CONTACTS_TOGETHER;
pub use load_column::{LoadColumn, UnitLoad};
pub use loaded_set::{LoadedAnswer, LoadedSet};
pub use small_system::ContactAnswer;
pub use touched::{Contact, Touched};
