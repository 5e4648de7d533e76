//! Finite element server of Softgrasp, as a library so that the client can embed it.
//!
//! The way of a request: [`session`] reads a frame from its socket and decodes it, [`compute`]
//! takes it from tokio to the rayon pool through a bounded queue, [`answer`] finds the model (in the
//! [`store`] or in the request) and the [`approach`], [`condensed`] or [`direct`] solves, and the
//! session writes the reply.

mod admission;
mod answer;
mod approach;
mod caution;
mod clock;
mod compute;
mod condensed;
mod config;
mod direct;
mod memory;
mod planned;
mod question;
mod rates;
mod reject;
mod server;
mod session;
mod store;

pub use clock::StageWatch;
pub use config::{ConfigError, ServerConfig};
pub use memory::available_bytes;
pub use rates::measure_rates;
pub use server::{RunningServer, StartError, serve, sockets_runtime, start};
