//! Fill-reducing order: nested dissection of the graph of nodes by planes between their places.

mod dissection;
mod part;
mod separator;
mod vertex_cut;

pub(super) use dissection::{NodeGraph, nested_dissection};
