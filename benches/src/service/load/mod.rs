//! Number of clients at 60 Hz that one server answers in time, and its limit.

mod climb;
mod page;
mod row;

pub(super) use climb::measure;
