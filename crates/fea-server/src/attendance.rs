//! An accepted connection until it becomes a session: it is encrypted if the server is, must introduce
//! itself in time, and is closed if its room is needed.

use std::net::SocketAddr;
use std::time::Duration;

use tokio::net::TcpStream;
use tokio::time::Instant;
use tracing::Instrument;

use crate::log_line::foreign_sentence;
use crate::server_handle::{ServerHandle, stopped};
use crate::session::{self, Peer};
use crate::standing::{Greeting, Standing};

/// Time of silence after which the system asks the peer's machine whether it is there, and between such
/// questions; after some questions without an answer it gives the connection up.
const ALIVE_AFTER: Duration = Duration::from_secs(30);
const ALIVE_EVERY: Duration = Duration::from_secs(10);

/// Sets the socket's options: bytes are sent at once, and a machine that is gone is noticed.
pub(crate) fn make_ready(stream: &TcpStream) -> std::io::Result<()> {
    stream.set_nodelay(true)?;
    let alive = socket2::TcpKeepalive::new().with_time(ALIVE_AFTER).with_interval(ALIVE_EVERY);
    socket2::SockRef::from(stream).set_tcp_keepalive(&alive)
}

/// Serves a connection, encrypted if the server is.
pub(crate) async fn attend(stream: TcpStream, peer: SocketAddr, server: ServerHandle) {
    let peer = Peer::new(peer, &server);
    agree_and_serve(stream, peer, server).instrument(peer.span()).await;
}

async fn agree_and_serve(stream: TcpStream, peer: Peer, server: ServerHandle) {
    let resources = &server.resources;
    let limit = resources.config.greeting_limit;
    let guest = server.strangers.let_in(peer.address.ip());
    let greeting = Greeting { guest, until: Instant::now() + limit, limit };
    let Some(encryption) = &resources.config.encryption else {
        return session::serve(stream, peer, server, Standing::Stranger(greeting)).await;
    };
    let mut stop = server.stop.clone();
    let shaken = tokio::select! {
        shaken = encryption.acceptor().accept(stream) => shaken.map_err(|error| error.to_string()),
        too_late = greeting.ends() => Err(too_late.to_string()),
        () = stopped(&mut stop) => return,
    };
    match shaken {
        Ok(stream) => session::serve(stream, peer, server, Standing::Stranger(greeting)).await,
        Err(error) => {
            resources.metrics.not_introduced();
            if resources.log_lines.has_room(peer.address.ip()) {
                let error = foreign_sentence(error);
                tracing::info!(error, "connection ends before a session: TLS was not agreed on");
            }
        }
    }
}
