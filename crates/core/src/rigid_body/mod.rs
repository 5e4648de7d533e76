//! Rigid bodies that press on a soft object: shapes, signed distance, deepest point of a triangle.

mod closest;
mod deepest;
mod shape;
mod triangles;

pub use closest::Barycentric;
pub use deepest::Deepest;
pub use shape::{RigidShape, ShapeError, SignedDistance};
pub use triangles::{RigidMesh, RigidMeshError};
