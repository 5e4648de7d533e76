//! Report `hard-cases`: what every way does where numbers get difficult, against what was promised.

mod case;
mod contacts;
mod double_double;
mod families;
mod keep_shape;
mod large;
mod locking;
mod materials;
mod outcome;
mod pieces;
mod report;
mod row;
mod scales;
mod shapes;
mod slender;
mod slivers;
mod supports;
mod truth;
mod ways;

pub(crate) use locking::compliance as pushed_block;
pub use report::measure;
