//! An open serial port whose every operation is over soon.

use std::io::ErrorKind;
use std::path::Path;
use std::time::Duration;

use serial2::SerialPort;

/// Why a port cannot be used any more.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{why}")]
pub(super) struct Lost {
    /// Reason, in words.
    pub(super) why: String,
}

/// A port that was opened: 8 data bits, no parity, 1 stop bit, no flow control.
#[derive(Debug)]
pub(super) struct Port {
    port: SerialPort,
}

/// A device that hears nothing for so long is not waited for.
const WRITE_MAX: Duration = Duration::from_millis(100);
/// Longest wait of one reading.
const READ_MAX: Duration = Duration::from_millis(50);

impl Port {
    /// Opens a port.
    pub(super) fn open(path: &Path, baud: u32) -> Result<Self, Lost> {
        let opened = SerialPort::open(path, baud).and_then(|mut port| {
            port.set_write_timeout(WRITE_MAX)?;
            // What a former user has left unread is nobody's reply.
            port.discard_input_buffer()?;
            Ok(port)
        });
        match opened {
            Ok(port) => Ok(Self { port }),
            Err(error) => Err(Lost { why: why_not_open(path, &error) }),
        }
    }

    /// Reads what is there; waits for the first byte until `wait` or 50 ms are over. Returns how
    /// many bytes came.
    pub(super) fn read(&mut self, bytes: &mut [u8], wait: Duration) -> Result<usize, Lost> {
        // The system waits whole milliseconds.
        let wait = wait.clamp(Duration::from_millis(1), READ_MAX);
        let read = self.port.set_read_timeout(wait).and_then(|()| self.port.read(bytes));
        match read {
            Ok(0) => Err(Lost { why: "the line was hung up".to_owned() }),
            Ok(count) => Ok(count),
            Err(error) if is_later(error.kind()) => Ok(0),
            Err(error) => Err(Lost { why: format!("reading failed: {error}") }),
        }
    }

    /// Sends bytes; what a device that does not listen leaves over is forgotten.
    pub(super) fn write(&self, bytes: &[u8]) -> Result<(), Lost> {
        match self.port.write_all(bytes) {
            Ok(()) => Ok(()),
            Err(error) if is_later(error.kind()) => Ok(()),
            Err(error) => Err(Lost { why: format!("writing failed: {error}") }),
        }
    }

    /// Forgets what has arrived and was not read.
    pub(super) fn discard_input(&self) {
        if let Err(error) = self.port.discard_input_buffer() {
            tracing::debug!(%error, "input cannot be discarded");
        }
    }
}

fn is_later(kind: ErrorKind) -> bool {
    matches!(kind, ErrorKind::TimedOut | ErrorKind::WouldBlock | ErrorKind::Interrupted)
}

/// Why a port cannot be opened, and what to do about it.
pub(super) fn why_not_open(path: &Path, error: &std::io::Error) -> String {
    let path = path.display();
    match error.kind() {
        ErrorKind::NotFound => format!("there is no {path}"),
        ErrorKind::PermissionDenied if cfg!(unix) => format!(
            "{path} cannot be opened: permission denied; add yourself to the group dialout \
             (`sudo usermod -a -G dialout $USER`) and log in again"
        ),
        _ => format!("{path} cannot be opened: {error}"),
    }
}
