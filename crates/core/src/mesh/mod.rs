//! Tetrahedral meshes: the mesh itself, its surface, its quality, and the built-in objects.

mod tet_mesh;

pub use tet_mesh::{MeshError, TetMesh, signed_volume};
