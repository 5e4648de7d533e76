//! Contact mechanics: masks of fingertips on a surface, and points with Coulomb friction.

pub mod coulomb;
mod mask;
mod pressure;

pub use mask::{Mask, MaskError};
pub use pressure::SurfaceStars;
