//! Strain, stress, energy and an estimate of the mesh's error as fields of elements and of nodes.

mod linear;
mod recovery;
mod state;
mod tensor;
mod values;

pub(crate) use linear::{Materials, states_of_averaged, states_of_tet4, states_of_tet10};
pub(crate) use recovery::Recovery;
pub(crate) use state::{ElementState, at_corners, steepest_of};
pub use tensor::{Tensor, von_mises};
pub(crate) use tensor::{tensor_of, with_pressure};
pub use values::{ElementFields, Fields, NodeFields};

#[cfg(test)]
mod tests;
