//! Which serial ports there are, whether they can be opened, and what answers on them.

use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use super::glove_driver::{Payload, Reply, find_reply};
use super::port::{Lost, Port};
use super::tracker_driver::{find_status, refusals};

/// The device that answers on a port.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Found {
    /// A glove.
    Glove {
        /// Speed of the line, bits per second.
        baud: u32,
        /// Number of sensors, if the glove told it.
        sensors: Option<u8>,
        /// Name by which the glove identifies itself.
        identity: Option<String>,
    },
    /// A tracker.
    Tracker {
        /// Speed of the line, bits per second.
        baud: u32,
        /// Status record of the tracker.
        status: String,
    },
}

/// Speeds that are tried, bits per second, the likely ones first.
pub const BAUDS: [u32; 5] = [115_200, 38_400, 9_600, 19_200, 57_600];
/// How long a reply may take.
const REPLY_MAX: Duration = Duration::from_millis(250);

/// The serial ports of this machine, sorted by name.
///
/// # Errors
/// The error of the operating system, where it cannot list them.
pub fn serial_ports() -> std::io::Result<Vec<PathBuf>> {
    let mut ports = serial2::SerialPort::available_ports()?;
    ports.sort();
    ports.dedup();
    Ok(ports)
}

/// Why a port cannot be opened, in words; `None` if it can.
pub fn why_unusable(path: &Path) -> Option<String> {
    Port::open(path, BAUDS[0]).err().map(|lost| lost.why)
}

/// Asks at several speeds who is there; sends a few bytes to whatever it is.
///
/// # Errors
/// Why the port cannot be used, in words.
pub fn probe(path: &Path) -> Result<Option<Found>, String> {
    for baud in BAUDS {
        let asked = Port::open(path, baud).and_then(|mut port| ask_who(&mut port, baud));
        match asked {
            Ok(Some(found)) => return Ok(Some(found)),
            Ok(None) => {}
            Err(Lost { why }) => return Err(why),
        }
    }
    Ok(None)
}

fn ask_who(port: &mut Port, baud: u32) -> Result<Option<Found>, Lost> {
    // Ends whatever a glove may be sending; a tracker complains about it, which tells it.
    port.write(b"\x03")?;
    let mut heard = listen(port, |_| false)?;
    port.write(b"?S")?;
    let sensors = |heard: &[u8]| match find_reply(heard, b'S', Payload::Bytes(1)) {
        Some(Reply::Payload(payload)) => payload.first().copied(),
        _ => None,
    };
    heard.extend(listen(port, |heard| sensors(heard).is_some())?);
    if let Some(sensors) = sensors(&heard) {
        port.write(b"?i")?;
        let answer = |heard: &[u8]| find_reply(heard, b'i', Payload::Text);
        let identity = match answer(&listen(port, |heard| answer(heard).is_some())?) {
            Some(Reply::Payload(text)) => Some(String::from_utf8_lossy(&text).trim().to_owned()),
            _ => None,
        };
        return Ok(Some(Found::Glove { baud, sensors: Some(sensors), identity }));
    }
    let complained = !refusals(&heard).is_empty();
    // `S` makes a glove stream: it is stopped below.
    port.write(b"\rcS")?;
    let heard = listen(port, |heard| find_status(heard).is_some())?;
    let status = find_status(&heard);
    port.write(b"\x03")?;
    let status = status.or_else(|| complained.then(|| "no status record".to_owned()));
    Ok(status.map(|status| Found::Tracker { baud, status }))
}

/// Reads until `enough`, or the time for a reply is over.
fn listen(port: &mut Port, enough: impl Fn(&[u8]) -> bool) -> Result<Vec<u8>, Lost> {
    let begun = Instant::now();
    let mut heard = Vec::new();
    let mut bytes = [0; 256];
    while heard.len() < 4096 && !enough(&heard) {
        let left = REPLY_MAX.saturating_sub(begun.elapsed());
        let count = port.read(&mut bytes, left)?;
        heard.extend_from_slice(&bytes[..count]);
        // A glove that streams does not end it.
        if left.is_zero() && (count == 0 || begun.elapsed() > 4 * REPLY_MAX) {
            break;
        }
    }
    Ok(heard)
}
