//! Finite elements (thesis chapter 3): material, tetrahedra, assembly, strain.

mod assembly;
mod element;
pub mod fields;
pub mod hyperelastic;
mod material;
mod mid_edge;
mod nodal_patches;
mod pattern;
mod products;
mod quadratic_mesh;
mod six_node_face;
mod spread_load;
mod strain;
mod stress_recovery;
pub mod tet10;
pub mod tet10_points;
pub mod tet4;

use assembly::LameByRegion;
pub use assembly::{
    AssemblyError, Stiffness, assemble, assemble_nodal_pressure, assemble_quadratic,
};
pub use element::Element;
pub use element::{AXES, dof};
pub use material::{Material, MaterialError};
pub use mid_edge::MidEdgeFault;
pub use nodal_patches::NodalPatches;
pub use pattern::StiffnessPattern;
pub(crate) use products::{Products, forces_of_columns};
pub use quadratic_mesh::{QuadraticMesh, QuadraticMeshError, TooManyNodes};
pub use spread_load::{SpreadLoadError, SpreadLoads};
pub use strain::{StrainSummary, summarise_strain, summarise_strain_quadratic};
pub use stress_recovery::{OtherNodeCount, StressRecovery};
