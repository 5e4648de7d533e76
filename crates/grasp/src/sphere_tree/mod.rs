//! Octree of spheres over the surface vertices (thesis 4.2–4.4).

mod build;
mod contact;
#[cfg(test)]
mod naive;
mod node;
mod overlap;
mod refit;
#[cfg(test)]
mod tests;
mod tree;
mod triangles;

pub use contact::{ContactHit, TIP_HITS_MAX, tip_hits, vertex_normals};
pub use node::TreeError;
pub use overlap::{cylinder_meets_sphere, sphere_meets_sphere};
pub use tree::{Closeness, SphereTree, VisitedSphere};
pub use triangles::{SearchedSurface, triangles_near};
