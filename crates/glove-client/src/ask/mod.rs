//! Requests to the server, and the connection that they travel on.

pub mod calculix_deck;
pub mod connection;
pub mod contact_frame;
pub mod digest;
pub mod discretisation;
pub mod displacement_table;
pub mod endpoint;
pub mod gradient;
pub mod held_nodes;
pub mod link;
pub mod model_upload;
pub mod prefetch;
pub mod server_stream;
pub mod solve_settings;
pub mod unanswered;
