//! Contacts of fingertips as masks: the surface around a touched node, weighted by pressure.

mod mask;
mod pressure;

pub use mask::{Mask, MaskError};
pub use pressure::SurfaceStars;
