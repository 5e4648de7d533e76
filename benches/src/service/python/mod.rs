//! Frame rate of the Python client beside that of the Rust client, on the same server and question.

mod asked;
mod page;
mod peer;

pub(super) use page::measure;
