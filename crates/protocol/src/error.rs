//! Errors of a stream, a payload, a message to be sent, and the connection below.

use std::io;

use crate::{HEADER_LEN, Kind, MethodNameError, VERSION};

/// The byte stream cannot be trusted any more; the session ends, nothing is answered.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum FrameError {
    /// The peer speaks something else.
    #[error("a frame starts with {found:02x?}, not with \"SGRP\"")]
    Magic {
        /// The first bytes of the frame, as many as were needed to see it.
        found: Vec<u8>,
    },
    /// The peer speaks another version of this protocol.
    #[error(
        "the peer speaks protocol version {found}, this side speaks {VERSION}; bring the older one up to date"
    )]
    Version {
        /// The peer's version.
        found: u16,
    },
    /// The first 24 bytes of the header were damaged.
    #[error("header checksum is {stated:#010x} but its bytes give {computed:#010x}")]
    HeaderChecksum {
        /// CRC-32C in the header.
        stated: u32,
        /// CRC-32C of the bytes that came.
        computed: u32,
    },
    /// A flag is set that this version does not define.
    #[error("reserved header flags are set: {flags:#010x}")]
    ReservedFlags {
        /// The whole flags word.
        flags: u32,
    },
    /// The announced payload is over the limit; known before any of it has arrived.
    #[error("a payload of {payload_len} bytes is announced, the limit is {payload_len_max}")]
    PayloadTooLong {
        /// Announced bytes.
        payload_len: u32,
        /// Allowed bytes.
        payload_len_max: u32,
    },
    /// Header or payload were damaged.
    #[error("frame checksum is {stated:#010x} but its bytes give {computed:#010x}")]
    Checksum {
        /// CRC-32C in the header.
        stated: u32,
        /// CRC-32C of the bytes that came.
        computed: u32,
    },
    /// The stream ended inside a frame.
    #[error("the stream ended after {received} bytes of a frame of {}", length(*frame_len))]
    Truncated {
        /// Bytes of the frame that came.
        received: usize,
        /// Bytes of the whole frame, if its header was complete.
        frame_len: Option<usize>,
    },
}

/// One whole, undamaged frame does not hold a message; the session can go on.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum DecodeError {
    /// A rigid body of a shape that this version does not know.
    #[error("a rigid body has the shape number {kind}; there are 0 to 4")]
    UnknownShape {
        /// Its number.
        kind: u32,
    },
    /// An answer announces fields that nobody can have asked for here.
    #[error("an answer announces the fields {bits:#x}, of which some are not known")]
    UnknownFields {
        /// One bit for each.
        bits: u32,
    },
    /// No message has this number.
    #[error("unknown message kind {kind:#06x}")]
    UnknownKind {
        /// Number in the header.
        kind: u16,
    },
    /// A client's message where a server's is expected, or the other way round.
    #[error("{kind} travels in the other direction")]
    WrongDirection {
        /// What came.
        kind: Kind,
    },
    /// The part holds a value that does not exist (enum tag, boolean, text that is not UTF-8).
    #[error("the small part of the payload cannot be read: {source}")]
    Part {
        /// The decoder's own words.
        source: wincode::ReadError,
    },
    /// The part is over [`PART_LEN_MAX`](crate::PART_LEN_MAX).
    #[error("the small part of the payload has {len} bytes, the limit is {}", crate::PART_LEN_MAX)]
    PartTooLong {
        /// Its bytes.
        len: u64,
    },
    /// A text is longer than allowed.
    #[error("{what} has {len} bytes, the limit is {len_max}")]
    TextTooLong {
        /// Which text.
        what: &'static str,
        /// Its bytes.
        len: usize,
        /// Allowed bytes.
        len_max: u32,
    },
    /// A method's name holds other characters than it may.
    #[error(transparent)]
    MethodName(#[from] MethodNameError),
    /// An array announces more entries than allowed.
    #[error("{count} {what} are announced, the limit is {count_max}")]
    TooMany {
        /// Which array.
        what: &'static str,
        /// Announced entries.
        count: u32,
        /// Allowed entries.
        count_max: u32,
    },
    /// An array announces more entries than there are bytes.
    #[error("{what} need {needed} bytes, {there} are there")]
    ArrayCut {
        /// Which array.
        what: &'static str,
        /// Bytes announced.
        needed: u64,
        /// Bytes left in the payload.
        there: usize,
    },
    /// Masks announce other lengths than there are nodes in all of them.
    #[error("the masks are {lens_sum} nodes long in all, {entry_count} are announced")]
    MaskLengths {
        /// Sum of their lengths.
        lens_sum: u64,
        /// Announced nodes of all masks.
        entry_count: u32,
    },
    /// The bytes that fill up to the next multiple of eight are not zero.
    #[error("padding before byte {position} of the payload is not zero")]
    Padding {
        /// Offset of the end of the padding.
        position: usize,
    },
    /// Bytes are left after the last array.
    #[error("{count} bytes are left over at the end of the payload")]
    LeftOver {
        /// How many.
        count: usize,
    },
}

/// A message cannot be sent; nothing was appended to the buffer.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum EncodeError {
    /// A text or list in the bincode part is over [`PART_LEN_MAX`](crate::PART_LEN_MAX) by itself.
    #[error("the small part cannot be written: {source}")]
    Part {
        /// The encoder's own words.
        source: wincode::WriteError,
    },
    /// The bincode part (texts, mostly) is too long.
    #[error("the small part has {len} bytes, the limit is {}", crate::PART_LEN_MAX)]
    PartTooLong {
        /// Its bytes.
        len: usize,
    },
    /// More payload than the limits of this message allow, or than 32 bits count.
    #[error("the payload has {len} bytes, the limit is {len_max}")]
    PayloadTooLong {
        /// Its bytes.
        len: usize,
        /// Allowed bytes.
        len_max: u32,
    },
    /// More entries than 32 bits count.
    #[error("{count} {what} are more than 32 bits count")]
    TooMany {
        /// Which array.
        what: &'static str,
        /// Entries given.
        count: usize,
    },
    /// Two lists that belong together differ in length.
    #[error("{count} {what} where {expected} are needed")]
    CountMismatch {
        /// Which array.
        what: &'static str,
        /// Entries given.
        count: usize,
        /// Entries needed.
        expected: usize,
    },
}

/// Why a frame could not be read from or written to a stream.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ConnectionError {
    /// What came is not this protocol, or was damaged or cut.
    #[error(transparent)]
    Frame(#[from] FrameError),
    /// The stream's read timeout passed; what has come is kept, reading may go on.
    #[error("no bytes within the read timeout, {received} bytes into a frame")]
    ReadTimedOut {
        /// Bytes of the unfinished frame so far.
        received: usize,
    },
    /// The stream's write timeout passed; go on with `bytes[written..]` or give the stream up.
    #[error("the peer took no bytes within the write timeout, after {written} bytes")]
    WriteTimedOut {
        /// Bytes the stream has taken.
        written: usize,
    },
    /// The peer closed while bytes were still to be written.
    #[error("the peer closed the stream after {written} bytes")]
    Closed {
        /// Bytes the stream has taken.
        written: usize,
    },
    /// Anything else the operating system says.
    #[error("the stream failed: {0}")]
    Io(#[from] io::Error),
}

fn length(frame_len: Option<usize>) -> String {
    match frame_len {
        Some(len) => format!("{len}"),
        None => format!("at least {HEADER_LEN}"),
    }
}
