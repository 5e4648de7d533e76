//! Report `hard-cases`: the answers of every method to numerically difficult questions, and the promises
//! about them.

mod answer;
mod case;
mod contacts;
mod double_double;
mod families;
mod in_process;
mod keep_shape;
mod large;
mod locking;
mod materials;
mod outcome;
mod over_socket;
mod pieces;
mod refusal;
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
