//! Listens for lines of joints on a TCP port and on the UDP port of the same number.

use std::io::{ErrorKind, Read};
use std::net::{SocketAddr, TcpListener, TcpStream, UdpSocket};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use super::queue::{ArrivedBytes, ArrivedQueue};
use super::sender::LineBeginning;

/// Port on which senders of joints look for a listener if they are told no other.
pub const DEFAULT_PORT: u16 = 7879;
/// Connections that are held at once.
const CONNECTIONS_MAX: usize = 8;
/// Senders of datagrams that are told apart; datagrams of further senders are read, but these are not
/// counted.
const DATAGRAM_SENDERS_MAX: usize = 16;
/// A connection that was silent for so long gives way to a new one when there are too many.
const SILENT_AFTER: Duration = Duration::from_secs(10);
/// A sender of datagrams counts as present for so long after each datagram.
const PRESENT_FOR: Duration = Duration::from_secs(1);
/// Pause between two looks while somebody sends; bytes wait that long at most.
const PAUSE: Duration = Duration::from_micros(500);
/// Pause while nobody sends.
const IDLE_PAUSE: Duration = Duration::from_millis(10);
/// Datagrams read in one turn, so that they cannot keep connections waiting.
const DATAGRAMS_A_TURN: usize = 64;
/// Size of the buffer for reading, bytes: more than the largest datagram.
const READ_SIZE: usize = 1 << 16;
/// Bytes read from a connection in one turn.
const READ_A_TURN: usize = 1 << 14;
/// Ports that are tried when the system is asked for any.
const PORTS_TRIED: usize = 16;

/// Why the listener for joints cannot be started.
#[derive(Debug, thiserror::Error)]
pub enum JointsError {
    /// The TCP port cannot be had.
    #[error("cannot listen on TCP port {addr}")]
    Tcp {
        /// Address that was asked for.
        addr: SocketAddr,
        /// Error of the operating system.
        source: std::io::Error,
    },
    /// The UDP port cannot be had.
    #[error("cannot listen on UDP port {addr}")]
    Udp {
        /// Address that was asked for.
        addr: SocketAddr,
        /// Error of the operating system.
        source: std::io::Error,
    },
    /// The system starts no thread for the listener.
    #[error("no thread to listen for joints")]
    Thread {
        /// Error of the operating system.
        source: std::io::Error,
    },
}

/// Listens for senders of joints until it is dropped, on a thread of its own.
///
/// Up to eight connections at once and any number of senders of datagrams; a turn reads a bounded
/// number of bytes from each, so none keeps another waiting. When all eight are taken, a new
/// connection replaces the one that was silent longest, if that was 10 s or more, and is closed
/// otherwise. What bytes mean is not looked at, so bad ones end nothing.
///
/// To be started before its owner asks for real-time priority, which a new thread would inherit.
#[derive(Debug)]
pub struct JointsListener {
    shared: Arc<Shared>,
    addr: SocketAddr,
    thread: Option<JoinHandle<()>>,
}

#[derive(Debug, Default)]
struct Shared {
    queue: ArrivedQueue,
    senders: AtomicUsize,
    stop: AtomicBool,
}

impl JointsListener {
    /// Listens on this address; with port 0 on any port that is free for TCP and UDP.
    ///
    /// # Errors
    /// [`JointsError`] when a port is taken or the system gives no thread.
    pub fn bind(addr: SocketAddr) -> Result<Self, JointsError> {
        let (tcp, udp, addr) = sockets(addr)?;
        let shared = Arc::new(Shared::default());
        let turns = Turns {
            tcp,
            udp,
            connections: Vec::new(),
            udp_senders: Vec::new(),
            buffer: vec![0; READ_SIZE],
            shared: Arc::clone(&shared),
        };
        let thread = std::thread::Builder::new()
            .name("joints".to_owned())
            .spawn(move || turns.run())
            .map_err(|source| JointsError::Thread { source })?;
        Ok(Self { shared, addr, thread: Some(thread) })
    }

    /// All bytes that have arrived since the last call, oldest first. Never waits; when the
    /// listening thread is just adding some, they come with the next call.
    pub fn take(&mut self) -> Vec<ArrivedBytes> {
        self.shared.queue.take()
    }

    /// Address and port on which the listener listens.
    pub const fn local_addr(&self) -> SocketAddr {
        self.addr
    }

    /// Number of senders: connections, and addresses from which a datagram came within the last second.
    pub fn senders(&self) -> usize {
        self.shared.senders.load(Ordering::Relaxed)
    }

    /// Number of pieces that were thrown away because they were not taken in time: the oldest go first.
    pub fn dropped(&self) -> u64 {
        self.shared.queue.dropped()
    }
}

impl Drop for JointsListener {
    fn drop(&mut self) {
        self.shared.stop.store(true, Ordering::Relaxed);
        if let Some(thread) = self.thread.take() {
            // A turn waits for nothing, so this takes a pause at most. A panic has been printed.
            let _ = thread.join();
        }
    }
}

/// Both sockets on one port, neither of which ever waits.
fn sockets(addr: SocketAddr) -> Result<(TcpListener, UdpSocket, SocketAddr), JointsError> {
    let mut tries = 1;
    loop {
        let tcp_error = |source| JointsError::Tcp { addr, source };
        let tcp = TcpListener::bind(addr).map_err(tcp_error)?;
        tcp.set_nonblocking(true).map_err(tcp_error)?;
        let bound = tcp.local_addr().map_err(tcp_error)?;
        let udp_error = |source| JointsError::Udp { addr: bound, source };
        match UdpSocket::bind(bound) {
            Ok(udp) => {
                udp.set_nonblocking(true).map_err(udp_error)?;
                return Ok((tcp, udp, bound));
            }
            // Another program may have the UDP port of a number that is free for TCP.
            Err(_) if addr.port() == 0 && tries < PORTS_TRIED => tries += 1,
            Err(source) => return Err(udp_error(source)),
        }
    }
}

struct Connection {
    stream: TcpStream,
    beginning: LineBeginning,
    heard: Instant,
}

struct Turns {
    tcp: TcpListener,
    udp: UdpSocket,
    connections: Vec<Connection>,
    /// Addresses from which datagrams came, each with the time of the last one.
    udp_senders: Vec<(SocketAddr, Instant)>,
    buffer: Vec<u8>,
    shared: Arc<Shared>,
}

impl Turns {
    fn run(mut self) {
        while !self.shared.stop.load(Ordering::Relaxed) {
            let now = Instant::now();
            self.read_datagrams(now);
            self.accept(now);
            self.read_connections(now);
            self.udp_senders.retain(|(_, heard)| now.duration_since(*heard) < PRESENT_FOR);
            let senders = self.connections.len() + self.udp_senders.len();
            self.shared.senders.store(senders, Ordering::Relaxed);
            std::thread::sleep(if senders > 0 { PAUSE } else { IDLE_PAUSE });
        }
    }

    fn read_datagrams(&mut self, now: Instant) {
        for _ in 0..DATAGRAMS_A_TURN {
            // An error that a sender causes (port unreachable) is over with this call.
            let Ok((length, from)) = self.udp.recv_from(&mut self.buffer) else { return };
            let mut bytes = self.buffer[..length].to_vec();
            if bytes.last().is_some_and(|&last| last != b'\n') {
                bytes.push(b'\n');
            }
            self.note_sender(from, now);
            if !bytes.is_empty() {
                self.shared.queue.push(ArrivedBytes { arrived: now, datagram: true, bytes });
            }
        }
    }

    fn note_sender(&mut self, from: SocketAddr, now: Instant) {
        let count = self.udp_senders.len();
        match self.udp_senders.iter_mut().find(|(known, _)| *known == from) {
            Some((_, heard)) => *heard = now,
            None if count < DATAGRAM_SENDERS_MAX => self.udp_senders.push((from, now)),
            None => {}
        }
    }

    fn accept(&mut self, now: Instant) {
        // At most a few a turn; an error (too many open files) is tried again in the next.
        for _ in 0..CONNECTIONS_MAX {
            let Ok((stream, _)) = self.tcp.accept() else { return };
            if stream.set_nonblocking(true).is_err() {
                continue;
            }
            if self.connections.len() >= CONNECTIONS_MAX && !self.close_a_silent_one(now) {
                continue;
            }
            let beginning = LineBeginning::default();
            self.connections.push(Connection { stream, beginning, heard: now });
        }
    }

    /// Closes the connection that was silent longest, if that is long enough.
    fn close_a_silent_one(&mut self, now: Instant) -> bool {
        let oldest = self.connections.iter().enumerate().min_by_key(|(_, c)| c.heard);
        match oldest {
            Some((at, connection)) if now.duration_since(connection.heard) >= SILENT_AFTER => {
                self.connections.remove(at);
                true
            }
            _ => false,
        }
    }

    fn read_connections(&mut self, now: Instant) {
        let Self { connections, buffer, shared, .. } = self;
        let buffer = &mut buffer[..READ_A_TURN];
        let hand_on = |bytes: Vec<u8>| {
            if !bytes.is_empty() {
                shared.queue.push(ArrivedBytes { arrived: now, datagram: false, bytes });
            }
        };
        for mut connection in std::mem::take(connections) {
            let is_open = match connection.stream.read(buffer) {
                Ok(0) => false,
                Ok(length) => {
                    connection.heard = now;
                    hand_on(connection.beginning.take(&buffer[..length]));
                    true
                }
                Err(e) => matches!(e.kind(), ErrorKind::WouldBlock | ErrorKind::Interrupted),
            };
            if is_open {
                connections.push(connection);
            } else {
                hand_on(connection.beginning.end());
            }
        }
    }
}

#[cfg(test)]
#[path = "listener_tests.rs"]
mod tests;
