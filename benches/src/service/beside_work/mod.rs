//! What one client's long work costs the others, and what a crowd's bytes cost the server.

mod bars;
mod beside;
mod page;
mod probe;
mod receiving;

pub(super) use page::measure;
