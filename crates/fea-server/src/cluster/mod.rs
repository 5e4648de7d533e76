//! The server's way to a cluster: a client of the wire that hands questions over.

mod client;
mod conversation;
mod endpoint;

pub use client::Cluster;
pub use endpoint::{ClusterEndpoint, EndpointError};
