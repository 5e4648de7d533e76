//! Fills a surface with tetrahedra, and says how far the mesh is from it.
//!
//! The inside is where the generalised winding number is above a half, so holes, turned and doubled
//! triangles and shells that overlap are no obstacle. Cubes of an octree, small along the surface,
//! smaller where the body is thin and large in its middle, are cut along the surface by isosurface
//! stuffing; then the boundary is moved until the volume is right.

mod carve;
mod deviation;
mod fit;
mod grid;
mod octree;
mod skin;
mod swell;

#[cfg(test)]
mod banana_tests;
mod filling;
#[cfg(test)]
mod tests;

pub use deviation::Deviation;
pub use filling::{FILL_NODES_MAX, FILL_NODES_MIN, FillError, FillTarget, Filled, fill};
