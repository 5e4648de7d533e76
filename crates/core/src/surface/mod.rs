//! Surfaces of triangles as scanners and drawing programs give them: mended, asked what is inside.

mod mending;
mod moments;
mod oriented;
mod tree;
mod triangle_surface;

#[cfg(test)]
pub(crate) mod samples;

pub use mending::Hole;
pub use mending::{MendedSurface, SurfaceMending};
pub use tree::{Closest, Hit, SurfaceTree};
pub use triangle_surface::{SurfaceError, TriangleSurface};
