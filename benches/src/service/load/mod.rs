//! How many clients at 60 Hz one server serves in time, and what stops it.

mod climb;
mod page;
mod row;

pub(super) use climb::measure;
