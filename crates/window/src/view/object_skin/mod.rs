//! How an object looks: a smooth skin over the computed surface, painted, with what rides on it.

mod anchor;
mod bake;
mod body;
mod calyx;
mod cap;
mod crease;
mod curved_surface;
mod fruit_paint;
mod lettering;
mod look;
mod part;
mod seeds;
mod skin;
mod tessellation;
mod toy_paint;
mod tube_paint;
mod tube_profile;
mod unwrap;

#[cfg(test)]
mod tests;

pub use look::Look;
pub use part::{Part, SurfaceMaterial};
pub use skin::ObjectSkin;
