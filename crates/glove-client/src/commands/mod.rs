//! The commands of `glove-client`, one file each; `main` only parses and prints the error.

pub mod inspect;
pub mod mesh;
mod output;
pub mod run;
pub mod solve;

pub(crate) use solve::mesh_data;
