//! A server under malformed frames, hostile connections, long work of others, restarts and a long run.

mod bars;
mod hostile;
mod long_run;
mod malformed;
mod report;
mod restarts;

pub(super) use report::measure;
