//! A server without sockets: its sessions are served over pipes in memory, on the caller's runtime.
//!
//! For programs that have server and client in one process and want neither a port nor a thread of
//! sockets, and for tests that set the clock and damage what passes.

use std::net::{IpAddr, Ipv4Addr, SocketAddr};

use tokio::io::{DuplexStream, duplex};
use tokio::sync::watch;
use tracing::Instrument;

use crate::config::ServerConfig;
use crate::server::StartError;
use crate::server_handle::ServerHandle;
use crate::session::{self, Peer};
use crate::standing::Standing;
use crate::status_pages::gauges;
use crate::workers::Workers;

/// A server whose clients are in the same process; dropping it ends its sessions.
pub struct LocalServer {
    server: ServerHandle,
    // Sessions end when it is dropped.
    _stop: watch::Sender<bool>,
}

/// Largest number of bytes in a pipe.
const PIPE_BYTES: usize = 64 * 1024;
/// Address that all sessions count for.
const PEER: SocketAddr = SocketAddr::new(IpAddr::V4(Ipv4Addr::LOCALHOST), 0);

impl LocalServer {
    /// Starts the solving threads; addresses and encryption of the settings are not used.
    ///
    /// # Errors
    /// [`StartError`].
    pub fn new(config: ServerConfig) -> Result<Self, StartError> {
        config.check()?;
        let threads = config.threads;
        let workers = Workers::new(threads, config.max_queue)
            .map_err(|source| StartError::Threads { threads, source })?;
        let (stop, stopped) = watch::channel(false);
        Ok(Self { server: ServerHandle::new(config, workers, stopped), _stop: stop })
    }

    /// Opens a session: the client's end of its pipe, and the future that serves it, to be spawned or
    /// polled beside the client. `None` if all places for sessions are taken.
    pub fn connect(&self) -> Option<(DuplexStream, impl Future<Output = ()> + Send + use<>)> {
        let place = self.server.places.take(PEER.ip()).ok()?;
        let (client, stream) = duplex(PIPE_BYTES);
        let server = self.server.clone();
        let peer = Peer::new(PEER, &server);
        let serves = session::serve(
            stream,
            peer,
            server,
            Standing::Known { _place: place, _of_token: None },
        );
        Some((client, serves.instrument(peer.span())))
    }

    /// Text of the page `/metrics`.
    pub fn metrics(&self) -> String {
        self.server.resources.metrics.text(&gauges(&self.server, true))
    }
}
