//! Finite elements (thesis chapter 3): material, tetrahedra of four and ten nodes, assembly, strain.

mod assembly;
mod element;
mod material;
mod nodal_patches;
mod pattern;
mod quadratic_mesh;
mod strain;
pub mod tet10;
pub mod tet4;

pub use assembly::{
    AssemblyError, Stiffness, assemble, assemble_nodal_pressure, assemble_quadratic,
};
pub use element::Element;
pub use material::{Material, MaterialError};
pub use nodal_patches::NodalPatches;
pub use pattern::StiffnessPattern;
pub use quadratic_mesh::{QuadraticMesh, TooManyNodes};
pub use strain::{StrainSummary, summarise_strain, summarise_strain_quadratic};

/// Degrees of freedom per node: displacements along x, y and z.
pub const AXES: usize = 3;

/// Index of the degree of freedom of `node` along `axis` (0 x, 1 y, 2 z): `3·node + axis` (3.45).
pub const fn dof(node: usize, axis: usize) -> usize {
    AXES * node + axis
}
