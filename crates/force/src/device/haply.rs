//! A Haply Inverse3 by the WebSocket of its service: every state is answered by the newest force.

use std::net::{TcpStream, ToSocketAddrs};
use std::time::{Duration, Instant};

use nalgebra::Vector3;
use tungstenite::{Message, WebSocket};

use super::error::DeviceError;
use super::haply_message::{force_message, state_of};
use super::link::{Link, Said, is_later};

/// The connection to the service, on a thread of its own.
#[derive(Debug)]
pub(crate) struct HaplyLink(Link<Told>);

/// What the link and the ticks tell each other.
#[derive(Debug)]
struct Told {
    place: Option<(Vector3<f64>, Instant)>,
    /// Newest force, N, and when it was rendered.
    force: (Vector3<f64>, Instant),
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
        let told = Told { place: None, force: (Vector3::zeros(), Instant::now()) };
        let url = url.to_owned();
        Link::start("Haply", told, move |said| Line { url, said }.keep()).map(Self)
    }

    pub(super) fn place(&self) -> Option<Vector3<f64>> {
        self.0.said().place.map(|(place, _)| place)
    }

    pub(super) fn is_lost(&self, now: Instant) -> bool {
        let seen = self.0.said().place.map(|(_, at)| at);
        seen.is_none_or(|at| now.saturating_duration_since(at) > SILENCE_MAX)
    }

    pub(super) fn render(&self, force: Vector3<f64>) {
        self.0.said().force = (force, Instant::now());
    }

    pub(super) fn close(self) -> Option<String> {
        self.0.close()
    }
}

/// The side of the thread.
struct Line {
    url: String,
    said: Said<Told>,
}

impl Line {
    /// Connects again and again until the link ends.
    fn keep(&self) {
        while !self.said.lock().ends {
            if let Err(why) = self.speak() {
                tracing::debug!(%why, url = %self.url, "no Haply");
                self.said.lock().why_lost = Some(why);
                let until = Instant::now() + AGAIN_AFTER;
                while Instant::now() < until && !self.said.lock().ends {
                    std::thread::sleep(READ_MAX);
                }
            }
        }
    }

    /// Speaks with the service until the link ends.
    fn speak(&self) -> Result<(), String> {
        let mut socket = self.connect()?;
        self.said.lock().why_lost = None;
        let mut device: Option<String> = None;
        loop {
            let ends = self.said.lock().ends;
            match socket.read() {
                Ok(Message::Text(text)) => {
                    if let Some(state) = state_of(text.as_str()) {
                        self.said.lock().place = Some((state.place, Instant::now()));
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
        let (force, at) = self.said.lock().force;
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
