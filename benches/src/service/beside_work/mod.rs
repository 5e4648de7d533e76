//! Effect of one client's long work on the others, and of a crowd's large requests on the server.

mod bars;
mod beside;
mod page;
mod probe;
mod receiving;

pub(super) use page::measure;
