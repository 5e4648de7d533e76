//! Finite element server of Softgrasp, as a library so that the client can embed it.
//!
//! Who may come at all: [`attendance`] gives [`strangers`] a moment to introduce themselves,
//! [`encryption`] hides what they say, [`access`] wants the token, [`places`] bound the sessions. The path
//! of a request: [`session`] reads a message from its socket, [`request_handler`] decodes it, [`workers`]
//! take it from tokio to a rayon pool through a bounded queue, [`request`] checks what it names, [`plan`]
//! decides by which method it is answered and reserves the memory, [`answer`] finds the model (in the
//! [`store`] or in the request) and solves, and the session writes the reply. [`resources`] are what all
//! requests share; [`status_pages`] tell of them. [`arguments`] are what a person types. What is too large
//! for this server goes to an [`engine`]: to a [`cluster`], or to the program that has this library.
//!
//! ```
//! use std::net::SocketAddr;
//!
//! // In this process, on a free port of the loopback; `glove-client --server embedded` does the same.
//! let listen = SocketAddr::from(([127, 0, 0, 1], 0));
//! let config = fea_server::ServerConfig { listen, threads: 1, ..Default::default() };
//! let server = fea_server::start(config)?;
//! assert_ne!(server.address().port(), 0);
//! server.stop();
//! # Ok::<(), fea_server::StartError>(())
//! ```

mod access;
mod answer;
pub mod arguments;
mod attendance;
mod awaited;
mod budget;
mod certificate;
mod client_connection;
mod clock;
pub mod cluster;
mod config;
mod contact_steps;
mod encryption;
pub mod engine;
mod held_models;
mod local_server;
mod lock;
mod log_line;
mod machine_memory;
mod manners;
mod metrics;
mod no_room;
mod observed;
mod origin;
mod pace;
mod paths;
mod places;
mod plan;
mod refusal;
mod request;
mod request_handler;
mod request_trace;
mod resources;
mod room;
mod server;
mod server_handle;
mod session;
mod standing;
mod status_pages;
mod store;
mod strangers;
mod tokens;
mod uploads;
mod workers;

pub use certificate::{MakeError, Validity, ValidityError, make_certificate};
pub use clock::StageWatch;
pub use config::{ConfigError, ServerConfig};
pub use encryption::{Encryption, EncryptionError};
pub use local_server::LocalServer;
pub use machine_memory::available_bytes;
pub use plan::measure_rates;
pub use server::{Listening, RunningServer, StartError, serve, sockets_runtime, start};
pub use tokens::{Tokens, TokensError};
