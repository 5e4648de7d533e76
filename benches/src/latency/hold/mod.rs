//! A request every millisecond for a minute, beside a loop that asks nobody.

mod holder;
mod kept;
mod report;
mod turns;

pub(super) use report::measure;
