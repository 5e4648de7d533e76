//! Report `accuracy`: every element against closed forms and published values.
//!
//! A further element is one more entry of the list in `elements.rs`.

mod bar;
mod block;
mod cantilever;
mod clamped_block;
mod discrete;
mod elements;
mod indentation;
mod large;
mod membrane;
mod mirror;
mod outcome;
mod patch;
mod quadrature;
mod report;
mod thick_sphere;
mod waves;

use elements::{ELEMENTS, order};
pub use report::measure;
