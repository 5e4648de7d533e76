//! Finite element server of Softgrasp, as a library so that the client can embed it.
//!
//! Who may come at all: [`places`] bound the sessions, [`encryption`] hides them, [`access`] wants the
//! token. The path of a request: [`session`] reads a message from its socket and decodes it, [`workers`]
//! take it from tokio to the rayon pool through a bounded queue, [`request`] checks what it names,
//! [`plan`] decides by which method it is answered and reserves the memory, [`answer`] finds the model
//! (in the [`store`] or in the request) and solves, and the session writes the reply. [`resources`]
//! are what all requests share.

mod access;
mod answer;
mod budget;
mod client_connection;
mod clock;
mod config;
mod encryption;
mod held_models;
mod lock;
mod machine_memory;
mod paths;
mod places;
mod plan;
mod refusal;
mod request;
mod resources;
mod server;
mod session;
mod store;
mod uploads;
mod workers;

pub use clock::StageWatch;
pub use config::{ConfigError, ServerConfig};
pub use encryption::{Encryption, EncryptionError, make_certificate};
pub use machine_memory::available_bytes;
pub use plan::measure_rates;
pub use server::{RunningServer, StartError, serve, sockets_runtime, start};
