//! Loopback proxy that splits, delays, damages or cuts the bytes that pass.

use std::io::{ErrorKind, Read, Write};
use std::net::{Shutdown, SocketAddr, TcpListener, TcpStream};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;
use std::time::Duration;

use crate::random::Random;

/// Pieces in which bytes are passed on.
#[derive(Clone, Debug, Default)]
pub enum Pieces {
    /// Pieces as they come.
    #[default]
    Whole,
    /// Pieces that end before these offsets of the stream, ascending.
    CutAt(Vec<u64>),
    /// Pieces of one byte.
    OneByte,
    /// Pieces of 1 to 97 bytes, drawn from this seed.
    Random(u64),
}

/// Faults on one direction of a connection.
#[derive(Clone, Debug, Default)]
pub struct Way {
    /// Pieces in which the bytes are passed on.
    pub pieces: Pieces,
    /// Delay before every piece.
    pub delay: Option<Duration>,
    /// Number of bytes after which the whole connection is closed.
    pub close_after: Option<u64>,
    /// Offset of the byte whose lowest bit is inverted.
    pub flip_at: Option<u64>,
}

/// Faults on both directions of a connection.
#[derive(Clone, Debug, Default)]
pub struct Faults {
    /// Faults from client to server.
    pub to_server: Way,
    /// Faults from server to client.
    pub to_client: Way,
}

/// Bytes that came in on both directions of one connection, before any fault.
#[derive(Clone, Debug, Default)]
pub struct Recorded {
    /// Bytes from the client.
    pub to_server: Vec<u8>,
    /// Bytes from the server.
    pub to_client: Vec<u8>,
}

struct State {
    server: Mutex<SocketAddr>,
    faults: Mutex<Faults>,
    recorded: Mutex<Recorded>,
    stopping: AtomicBool,
}

/// Running proxy; dropping it ends it.
///
/// The bytes of one connection are recorded: of the last one accepted.
pub struct FaultyProxy {
    address: SocketAddr,
    state: Arc<State>,
    thread: Option<JoinHandle<()>>,
}

/// Time without a byte after which a pump checks whether its proxy has ended.
const LOOK_EVERY: Duration = Duration::from_millis(500);

impl FaultyProxy {
    /// Listens on loopback and passes bytes to `server`, at first without faults.
    ///
    /// # Panics
    /// If the system gives no socket or no thread.
    pub fn start(server: SocketAddr) -> Self {
        let listener = TcpListener::bind(("127.0.0.1", 0)).expect("a free loopback port");
        let address = listener.local_addr().expect("a bound address");
        let state = Arc::new(State {
            server: Mutex::new(server),
            faults: Mutex::default(),
            recorded: Mutex::default(),
            stopping: AtomicBool::new(false),
        });
        let shared = Arc::clone(&state);
        let thread = std::thread::spawn(move || accept_all(&listener, &shared));
        Self { address, state, thread: Some(thread) }
    }

    /// Address that clients connect to.
    pub fn address(&self) -> SocketAddr {
        self.address
    }

    /// Sets the faults of the connections that are accepted from now on.
    pub fn set(&self, faults: Faults) {
        *lock(&self.state.faults) = faults;
    }

    /// Passes bytes to another server, from the next connection on.
    pub fn lead_to(&self, server: SocketAddr) {
        *lock(&self.state.server) = server;
    }

    /// Bytes that have passed on the last connection so far.
    pub fn recorded(&self) -> Recorded {
        lock(&self.state.recorded).clone()
    }
}

impl Drop for FaultyProxy {
    fn drop(&mut self) {
        self.state.stopping.store(true, Ordering::Relaxed);
        // Wakes the accepting thread.
        let _ = TcpStream::connect(self.address);
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

fn accept_all(listener: &TcpListener, state: &Arc<State>) {
    for client in listener.incoming() {
        if state.stopping.load(Ordering::Relaxed) {
            return;
        }
        let Ok(client) = client else { continue };
        // A server that is not there shows as an early close.
        let Ok(server) = TcpStream::connect(*lock(&state.server)) else { continue };
        let faults = lock(&state.faults).clone();
        *lock(&state.recorded) = Recorded::default();
        let pair = [
            (&client, &server, faults.to_server, true),
            (&server, &client, faults.to_client, false),
        ];
        for (from, to, way, is_to_server) in pair {
            let (Ok(from), Ok(to)) = (from.try_clone(), to.try_clone()) else { return };
            let state = Arc::clone(state);
            std::thread::spawn(move || {
                let mut pump = Pump { from, to, way, passed: 0, is_to_server, state };
                if pump.run().is_err() {
                    pump.close();
                }
            });
        }
    }
}

/// Passes bytes in one direction of one connection.
struct Pump {
    from: TcpStream,
    to: TcpStream,
    way: Way,
    passed: u64,
    is_to_server: bool,
    state: Arc<State>,
}

impl Pump {
    /// Runs until the sender ends or the connection is to be closed.
    fn run(&mut self) -> std::io::Result<()> {
        self.from.set_read_timeout(Some(LOOK_EVERY))?;
        self.to.set_nodelay(true)?;
        let mut random = match self.way.pieces {
            Pieces::Random(seed) => Random::new(seed),
            _ => Random::new(0),
        };
        let mut buffer = vec![0; 64 * 1024];
        while self.way.close_after != Some(self.passed) {
            let count = match self.from.read(&mut buffer) {
                Ok(0) => return self.to.shutdown(Shutdown::Write),
                Ok(count) => count,
                Err(error) => match error.kind() {
                    ErrorKind::WouldBlock | ErrorKind::TimedOut
                        if !self.state.stopping.load(Ordering::Relaxed) =>
                    {
                        continue;
                    }
                    ErrorKind::Interrupted => continue,
                    _ => return Err(error),
                },
            };
            let mut rest = buffer.get_mut(..count).unwrap_or_default();
            self.record(rest);
            while !rest.is_empty() && self.way.close_after != Some(self.passed) {
                let len = self.piece_len(rest.len(), &mut random);
                let (piece, later) = rest.split_at_mut(len);
                self.pass(piece)?;
                rest = later;
            }
        }
        self.close();
        Ok(())
    }

    fn pass(&mut self, piece: &mut [u8]) -> std::io::Result<()> {
        let start = self.passed;
        self.passed += piece.len() as u64;
        if let Some(at) = self.way.flip_at.filter(|at| (start..self.passed).contains(at))
            && let Some(byte) = piece.get_mut((at - start) as usize)
        {
            *byte ^= 1;
        }
        if let Some(delay) = self.way.delay {
            std::thread::sleep(delay);
        }
        self.to.write_all(piece)?;
        // Gives the reader a chance to see this piece alone.
        std::thread::yield_now();
        Ok(())
    }

    /// Length of the next piece, 1 to `there`.
    fn piece_len(&self, there: usize, random: &mut Random) -> usize {
        let wanted = match &self.way.pieces {
            Pieces::Whole => there,
            Pieces::OneByte => 1,
            Pieces::Random(_) => 1 + random.below(97),
            Pieces::CutAt(offsets) => {
                let next = offsets.get(offsets.partition_point(|&o| o <= self.passed));
                next.map_or(there, |&next| (next - self.passed) as usize)
            }
        };
        let until_close = match self.way.close_after {
            Some(end) => usize::try_from(end - self.passed).unwrap_or(usize::MAX),
            None => usize::MAX,
        };
        wanted.min(there).min(until_close)
    }

    fn record(&self, bytes: &[u8]) {
        let mut recorded = lock(&self.state.recorded);
        let way = match self.is_to_server {
            true => &mut recorded.to_server,
            false => &mut recorded.to_client,
        };
        way.extend_from_slice(bytes);
    }

    fn close(&self) {
        let _ = self.from.shutdown(Shutdown::Both);
        let _ = self.to.shutdown(Shutdown::Both);
    }
}
