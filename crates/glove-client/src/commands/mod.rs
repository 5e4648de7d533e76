//! The commands of `glove-client`, one file each; `main` only parses and prints the error.

pub mod inspect;
mod key_frames;
pub mod mesh;
mod numbers;
mod output;
pub mod run;
mod run_arguments;
pub mod solve;
