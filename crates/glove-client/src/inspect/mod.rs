//! What is in a mesh file, and what an answer on it would cost.

pub mod forecast;
pub mod inspection;
pub mod mending_summary;
