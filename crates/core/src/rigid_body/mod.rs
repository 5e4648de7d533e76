//! Rigid bodies that press on a soft object: shapes, signed distance, deepest point of a triangle.

mod closest;
mod deepest;
mod shape;
mod triangles;

pub use closest::{Barycentric, Deepest, SignedDistance};
pub(crate) use closest::{area_normal, on_triangle, point_at};
pub use shape::{RigidShape, ShapeError};
pub use triangles::{RigidMesh, RigidMeshError};
