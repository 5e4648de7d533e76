//! The stream to a server: a TCP socket, plain or encrypted.

use std::io::{self, ErrorKind, Read, Write};
use std::net::TcpStream;
use std::time::Duration;

use rustls::{ClientConnection, StreamOwned};

use crate::ask::endpoint::{Endpoint, TrustError};

/// Socket to a server.
pub enum ServerStream {
    /// Bytes travel without encryption.
    Plain(TcpStream),
    /// Bytes travel through TLS.
    Encrypted(Box<StreamOwned<ClientConnection, TcpStream>>),
}

impl ServerStream {
    /// Stream over a connected socket, encrypted if the endpoint trusts certificates.
    ///
    /// # Errors
    /// [`TrustError`]; the handshake itself comes with the first bytes.
    pub fn new(socket: TcpStream, endpoint: &Endpoint) -> Result<Self, TrustError> {
        Ok(match &endpoint.trust {
            None => Self::Plain(socket),
            Some(trust) => {
                let session = trust.session(endpoint.host())?;
                Self::Encrypted(Box::new(StreamOwned::new(session, socket)))
            }
        })
    }

    /// Underlying socket, to set time limits on it or to shut it down.
    pub fn socket(&self) -> &TcpStream {
        match self {
            Self::Plain(socket) => socket,
            Self::Encrypted(stream) => &stream.sock,
        }
    }

    /// Sets the longest time that a read may wait.
    ///
    /// # Errors
    /// Error of the operating system.
    pub fn set_read_timeout(&self, at_most: Option<Duration>) -> io::Result<()> {
        self.socket().set_read_timeout(at_most)
    }

    /// Whether no unread bytes have come and the peer has not closed; never waits.
    pub fn is_quiet(&mut self) -> bool {
        if self.socket().set_nonblocking(true).is_err() {
            return false;
        }
        let is_quiet = match self {
            Self::Plain(socket) => {
                socket.peek(&mut [0]).is_err_and(|e| e.kind() == ErrorKind::WouldBlock)
            }
            Self::Encrypted(stream) => takes_only_records(stream),
        };
        let restored = self.socket().set_nonblocking(false);
        is_quiet && restored.is_ok()
    }
}

/// Reads what has come into TLS, such as tickets; returns whether none of it is data for the client.
fn takes_only_records(stream: &mut StreamOwned<ClientConnection, TcpStream>) -> bool {
    loop {
        match stream.conn.read_tls(&mut stream.sock) {
            Err(error) => return error.kind() == ErrorKind::WouldBlock,
            Ok(0) => return false,
            Ok(_) => match stream.conn.process_new_packets() {
                Ok(state) if state.plaintext_bytes_to_read() == 0 && !state.peer_has_closed() => {}
                _ => return false,
            },
        }
    }
}

impl Drop for ServerStream {
    /// Sends the end of the TLS connection, so that the server can tell it from a cut; it need not
    /// arrive.
    fn drop(&mut self) {
        if let Self::Encrypted(stream) = self {
            stream.conn.send_close_notify();
            let _ = stream.sock.set_nonblocking(true);
            let _ = stream.conn.write_tls(&mut stream.sock);
        }
    }
}

impl Read for ServerStream {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        match self {
            Self::Plain(socket) => socket.read(buffer),
            Self::Encrypted(stream) => stream.read(buffer),
        }
    }
}

impl Write for ServerStream {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        match self {
            Self::Plain(socket) => socket.write(bytes),
            Self::Encrypted(stream) => stream.write(bytes),
        }
    }

    fn flush(&mut self) -> io::Result<()> {
        match self {
            Self::Plain(socket) => socket.flush(),
            Self::Encrypted(stream) => stream.flush(),
        }
    }
}
