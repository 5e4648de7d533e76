//! Tetrahedral meshes: the mesh itself, its surface, its quality, and the built-in objects.

mod bodies;
mod folds;
mod generate;
mod inversion;
mod quality;
#[cfg(test)]
pub(crate) mod samples;
mod surface;
mod tet_mesh;

pub use bodies::Bodies;
pub(crate) use bodies::DisjointSets;
pub use folds::Folds;
pub use generate::{BuiltIn, GenerateError, NODES_MAX, NODES_MIN, UnknownShape, generate};
pub use inversion::Inversion;
pub use quality::{Quality, TetQuality, tet_quality};
pub use surface::Surface;
pub(crate) use tet_mesh::Incidence;
pub use tet_mesh::{MeshError, TetMesh, mirrored, mirrored_middles, signed_volume};
