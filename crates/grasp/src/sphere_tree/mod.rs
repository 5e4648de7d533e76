//! Octree of spheres over the surface vertices (thesis 4.2–4.4).

mod build;
mod contact;
mod levels;
#[cfg(test)]
mod naive;
mod overlap;
mod refit;
mod search;
#[cfg(test)]
mod tests;
mod tree;
mod triangles;
mod visited;

pub use contact::{Closeness, ContactHit, TIP_HITS_MAX, tip_hits, vertex_normals};
pub use overlap::{cylinder_meets_sphere, sphere_meets_sphere};
pub use tree::{SphereTree, TreeError};
pub use triangles::{SearchedSurface, triangles_near};
pub use visited::VisitedSphere;
