//! `condensed`: one factor per shape, then exact answers from a few columns of the compliance.
//!
//! Lineage: condensation (Bro-Nielsen and Cotin 1996), Green's functions and capacitance matrices
//! (James and Pai 1999). A base of degrees of freedom is held once per shape and `K_B` factored
//! ([`Base`]). The response to a unit force at a node is a column of `G = K_B⁻¹`, computed when
//! the node is first touched and kept ([`Columns`]). For a set of touched degrees of freedom C
//! ([`ContactSet`]) the forces λ and the motions without energy `a` follow from
//!
//! ```text
//! [ G_C   R_C ] [λ]   [ q ]
//! [ R_Cᵀ   0  ] [a] = [ 0 ]        u = G λ + R a
//! ```
//!
//! λ balances itself, so the artificial base carries nothing and `u` solves (3.43a) exactly; λ are
//! the reactions (3.43b). Nodes that the scene fixes are a true base and need no R.

mod base;
mod bound;
mod certificate;
mod columns;
mod contact_set;
#[cfg(test)]
mod tests;

pub use base::{Base, CondensedError};
pub use certificate::Certificate;
pub use columns::{Columns, NodeColumns};
pub use contact_set::{ContactAnswer, ContactSet};
