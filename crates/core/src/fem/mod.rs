//! Finite elements (thesis chapter 3): material, linear tetrahedron, assembly, strain.

mod assembly;
mod material;
mod pattern;
mod strain;
pub mod tet4;

pub use assembly::{AssemblyError, Stiffness, assemble};
pub use material::{Material, MaterialError};
pub use pattern::StiffnessPattern;
pub use strain::{StrainSummary, summarise_strain};

/// Degrees of freedom per node: displacements along x, y and z.
pub const AXES: usize = 3;

/// Index of the degree of freedom of `node` along `axis` (0 x, 1 y, 2 z): `3·node + axis` (3.45).
pub const fn dof(node: usize, axis: usize) -> usize {
    AXES * node + axis
}
