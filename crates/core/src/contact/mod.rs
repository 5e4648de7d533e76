//! Contact mechanics: masks of fingertips on a surface, and points with Coulomb friction.

pub mod coulomb;
mod mask;
mod pressure;
mod surface_load;

pub use mask::{Mask, MaskError};
pub use pressure::SurfaceStars;
pub use surface_load::SurfaceLoad;
