//! The commands of `glove-client`, one file each; `main` only parses and prints the error.

mod display_arguments;
pub mod inspect;
mod key_frames;
pub mod mesh;
mod numbers;
mod output;
pub mod run;
mod run_arguments;
#[cfg_attr(not(feature = "window"), path = "no_pictures.rs")]
mod run_pictures;
mod run_setup;
#[cfg(feature = "window")]
mod run_window;
pub mod solve;
mod tell_report;
