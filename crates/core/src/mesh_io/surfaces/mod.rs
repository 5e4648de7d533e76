//! Surface files: STL, OBJ, PLY, OFF and glTF, read into points and triangles.

mod gltf;
mod obj;
mod off;
mod parse;
mod ply;
mod raw_surface;
mod stl;

#[cfg(test)]
mod tests;

pub use parse::{SurfaceFile, SurfaceFormat, parse_surface, surface_format};
