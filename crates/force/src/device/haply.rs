//! A Haply Inverse3 by the WebSocket of its service: every state is answered by the newest force.

use std::net::{TcpStream, ToSocketAddrs};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use nalgebra::Vector3;
use tungstenite::{Message, WebSocket};

use super::DeviceError;
use super::haply_message::{force_message, state_of};

/// The connection to the service, on a thread of its own.
#[derive(Debug)]
pub(crate) struct HaplyLink {
    shared: Arc<Mutex<Shared>>,
    thread: Option<JoinHandle<()>>,
}

/// What the link and the ticks tell each other.
#[derive(Debug)]
struct Shared {
    place: Option<(Vector3<f64>, Instant)>,
    /// Newest force, N, and when it was rendered.
    force: (Vector3<f64>, Instant),
    ends: bool,
    /// Last reason why there is no connection.
    why_lost: Option<String>,
}

/// A place that is older is that of a lost device.
const SILENCE_MAX: Duration = Duration::from_millis(100);
/// A force that is older is not sent: the ticks have ended.
const FORCE_AGE_MAX: Duration = Duration::from_millis(50);
/// Longest wait for a message.
const READ_MAX: Duration = Duration::from_millis(20);
/// Longest wait for a connection, and the time between two attempts.
const CONNECT_MAX: Duration = Duration::from_millis(500);
const AGAIN_AFTER: Duration = Duration::from_millis(200);

impl HaplyLink {
    pub(super) fn open(url: &str) -> Result<Self, DeviceError> {
        let force = (Vector3::zeros(), Instant::now());
        let shared = Shared { place: None, force, ends: false, why_lost: None };
        let shared = Arc::new(Mutex::new(shared));
        let line = Line { url: url.to_owned(), shared: Arc::clone(&shared) };
        let thread = std::thread::Builder::new()
            .name("haply".to_owned())
            .spawn(move || line.keep())
            .map_err(DeviceError::Thread)?;
        Ok(Self { shared, thread: Some(thread) })
    }

    fn shared(&self) -> MutexGuard<'_, Shared> {
        self.shared.lock().unwrap_or_else(PoisonError::into_inner)
    }

    pub(super) fn place(&self) -> Option<Vector3<f64>> {
        self.shared().place.map(|(place, _)| place)
    }

    pub(super) fn is_lost(&self, now: Instant) -> bool {
        let seen = self.shared().place.map(|(_, at)| at);
        seen.is_none_or(|at| now.saturating_duration_since(at) > SILENCE_MAX)
    }

    pub(super) fn render(&self, force: Vector3<f64>) {
        self.shared().force = (force, Instant::now());
    }

    pub(super) fn close(mut self) -> Option<String> {
        self.end();
        let shared = self.shared();
        shared.why_lost.clone()
    }

    fn end(&mut self) {
        self.shared().ends = true;
        if let Some(thread) = self.thread.take()
            && thread.join().is_err()
        {
            tracing::error!("the thread of the Haply ended abnormally");
        }
    }
}

impl Drop for HaplyLink {
    fn drop(&mut self) {
        self.end();
    }
}

/// The side of the thread.
struct Line {
    url: String,
    shared: Arc<Mutex<Shared>>,
}

impl Line {
    fn shared(&self) -> MutexGuard<'_, Shared> {
        self.shared.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Connects again and again until the link ends.
    fn keep(&self) {
        while !self.shared().ends {
            if let Err(why) = self.speak() {
                tracing::debug!(%why, url = %self.url, "no Haply");
                self.shared().why_lost = Some(why);
                let until = Instant::now() + AGAIN_AFTER;
                while Instant::now() < until && !self.shared().ends {
                    std::thread::sleep(READ_MAX);
                }
            }
        }
    }

    /// Speaks with the service until the link ends.
    fn speak(&self) -> Result<(), String> {
        let mut socket = self.connect()?;
        self.shared().why_lost = None;
        let mut device: Option<String> = None;
        loop {
            let ends = self.shared().ends;
            match socket.read() {
                Ok(Message::Text(text)) => {
                    if let Some(state) = state_of(text.as_str()) {
                        self.shared().place = Some((state.place, Instant::now()));
                        device = Some(state.device_id);
                    }
                }
                Ok(Message::Close(_)) => return Err("the service closed the connection".to_owned()),
                Ok(_) => {}
                Err(tungstenite::Error::Io(error)) if is_later(error.kind()) => {}
                Err(error) => return Err(error.to_string()),
            }
            let Some(id) = &device else {
                if ends {
                    return Ok(());
                }
                continue;
            };
            let force = if ends { Vector3::zeros() } else { self.newest_force() };
            let message = Message::text(force_message(id, &force));
            socket.send(message).map_err(|error| error.to_string())?;
            if ends {
                let _ = socket.close(None);
                return Ok(());
            }
        }
    }

    /// The newest force; none where the ticks have stopped.
    fn newest_force(&self) -> Vector3<f64> {
        let (force, at) = self.shared().force;
        let is_new = at.elapsed() < FORCE_AGE_MAX && force.iter().all(|x| x.is_finite());
        if is_new { force } else { Vector3::zeros() }
    }

    fn connect(&self) -> Result<WebSocket<TcpStream>, String> {
        let host = self.url.trim_start_matches("ws://");
        let host = host.split('/').next().unwrap_or_default();
        let addresses = host.to_socket_addrs().map_err(|error| error.to_string())?;
        let mut why = format!("{host} has no address");
        for address in addresses {
            match TcpStream::connect_timeout(&address, CONNECT_MAX) {
                Ok(stream) => {
                    let set = stream
                        .set_nodelay(true)
                        .and_then(|()| stream.set_write_timeout(Some(CONNECT_MAX)))
                        .and_then(|()| stream.set_read_timeout(Some(CONNECT_MAX)));
                    set.map_err(|error| error.to_string())?;
                    let (socket, _) = tungstenite::client(self.url.as_str(), stream)
                        .map_err(|error| error.to_string())?;
                    let set = socket.get_ref().set_read_timeout(Some(READ_MAX));
                    set.map_err(|error| error.to_string())?;
                    return Ok(socket);
                }
                Err(error) => why = format!("{address}: {error}"),
            }
        }
        Err(why)
    }
}

/// Whether a read that brought nothing may be tried again.
fn is_later(kind: std::io::ErrorKind) -> bool {
    use std::io::ErrorKind::{Interrupted, TimedOut, WouldBlock};
    matches!(kind, Interrupted | TimedOut | WouldBlock)
}
