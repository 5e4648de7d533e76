//! Finite element server of Softgrasp, as a library so that the client can embed it.
//!
//! The way of a request: [`session`] reads a frame from its socket and decodes it, [`compute`]
//! takes it from tokio to the rayon pool through a bounded queue, [`answer`] does the work on a
//! [`store`]d or a one-shot model, and the session writes the reply.

mod answer;
mod clock;
mod compute;
mod config;
mod reject;
mod server;
mod session;
mod store;

pub use config::{ConfigError, ServerConfig};
pub use server::{RunningServer, StartError, serve, start};
