//! Turns bytes into messages of the Softgrasp wire and back, without I/O.
//!
//! A stream is a sequence of frames; a frame is a 32-byte header and a payload; a payload is one
//! small part in bincode's format, which may grow (unknown fields at its end are skipped), and raw
//! little-endian arrays. `docs/wire.md` describes every byte. The layers, bottom up:
//!
//! * [`Header`], [`Kind`], [`Limits`]: what a frame says about itself and how large it may be.
//! * [`FrameBuffer`]: bytes in any pieces → [`Frame`]s; "not yet" is `Ok(None)`, "wrong" is `Err`.
//! * [`Request`] (client → server) and [`Reply`] (server → client): frames ⇄ typed messages.
//! * [`blocking`] and [`asynchronous`]: thin adapters to std and tokio streams.
//!
//! It does not interpret a message: whether a degree of freedom exists, a coordinate is finite or
//! a method is known is the server's business.
//!
//! ```
//! use softgrasp_protocol::{FrameBuffer, Limits, Request};
//!
//! let limits = Limits::default();
//! let mut bytes = Vec::new();
//! Request::Ping { nonce: 7 }.encode_into(1, &limits, &mut bytes)?;
//!
//! // The stream brings them in any pieces: "not yet" is `None`, "wrong" is an error.
//! let mut buffer = FrameBuffer::new(limits);
//! buffer.feed(&bytes[..10]);
//! assert!(buffer.next_frame()?.is_none());
//! buffer.feed(&bytes[10..]);
//! let frame = buffer.next_frame()?.expect("all bytes have come");
//! assert_eq!(frame.request_id(), 1);
//! assert!(matches!(Request::decode(&frame, &limits)?, Request::Ping { nonce: 7 }));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

pub mod asynchronous;
mod block;
pub mod blocking;
mod error;
mod format;
mod frame_buffer;
mod header;
mod kind;
mod limits;
mod message;
mod payload;
pub mod solve_report;
mod trace;

pub use error::{ConnectionError, DecodeError, EncodeError, FrameError};
pub use format::{HEADER_LEN, MAGIC, PART_LEN_MAX, VERSION, VERSIONS, VersionRange};
pub use frame_buffer::{Frame, FrameBuffer};
pub use header::Header;
pub use kind::Kind;
pub use limits::Limits;
pub use message::*;
pub use trace::TraceContext;
