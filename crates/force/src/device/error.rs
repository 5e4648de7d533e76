//! Why a device of forces cannot be opened.

use std::io;
use std::path::PathBuf;

/// Why a device cannot be opened.
#[derive(Debug, thiserror::Error)]
pub enum DeviceError {
    /// The serial port cannot be opened.
    #[error("{path} cannot be opened as a serial port")]
    Port {
        /// The serial port.
        path: PathBuf,
        /// Error of the operating system.
        source: io::Error,
    },
    /// No datagram can be sent to an address.
    #[error("no datagrams can be sent to {address}")]
    Address {
        /// Host and port.
        address: String,
        /// Error of the operating system.
        source: io::Error,
    },
    /// The file cannot be written.
    #[error("{path} cannot be written")]
    File {
        /// The file.
        path: PathBuf,
        /// Error of the operating system.
        source: io::Error,
    },
    /// The system gives no thread.
    #[error("the system gives no thread for the device")]
    Thread(#[source] io::Error),
}
