//! Report `load`: how many clients at 60 Hz one server serves in time, and what stops it.

mod climb;
mod page;
mod row;

pub use climb::measure;
