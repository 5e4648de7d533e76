//! The built-in objects: meshes of any size made from a shape's name and a number of nodes.

mod built_in;
mod cube;
mod fit;
mod lattice;
mod solid;
mod split;
mod strawberry;
mod stuffing;
mod toothpaste;

#[cfg(test)]
mod tests;

pub use built_in::{BuiltIn, GenerateError, NODES_MAX, NODES_MIN, UnknownShape, generate};
