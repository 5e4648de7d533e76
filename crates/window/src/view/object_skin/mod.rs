//! How an object looks: a smooth skin over the computed surface, painted, with what rides on it.

mod anchor;
mod bake;
mod body;
mod calyx;
mod cap;
mod crease;
mod curved_surface;
mod lettering;
mod look;
mod paint;
mod part;
mod seeds;
mod skin;
mod tessellation;
mod tube_profile;
mod unwrap;

#[cfg(test)]
mod tests;

pub use look::Look;
pub use part::{Part, SurfaceMaterial};
pub use skin::ObjectSkin;
