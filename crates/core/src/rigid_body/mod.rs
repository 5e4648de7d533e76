//! Rigid bodies that press on a soft object: shapes, signed distance, deepest point of a triangle.

mod closed_surface;
mod closest;
mod cuboid;
mod deepest;
mod shape;
mod sizes;
mod triangles;

pub use closed_surface::RigidMeshError;
pub use closest::{Barycentric, Deepest, SignedDistance};
pub(crate) use closest::{area_normal, on_triangle, point_at};
pub use cuboid::Cuboid;
pub use shape::RigidShape;
pub use sizes::ShapeError;
pub use triangles::RigidMesh;
