//! What a fingertip holds where it touches: the surface around a node, weighted by pressure.

mod mask;
mod pressure;

pub use mask::{Mask, MaskError};
pub use pressure::SurfaceStars;
