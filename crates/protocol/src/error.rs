//! Errors of a stream, a payload, a message to be sent, and the connection below.

use std::io;

use crate::{HEADER_LEN, Kind, MethodNameError, VERSION};

/// The byte stream cannot be trusted any more; the session ends, nothing is answered.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum FrameError {
    /// The first bytes are not this protocol's magic: the peer speaks another protocol.
    #[error("a frame starts with {found:02x?}, not with \"SGRP\"")]
    Magic {
        /// The first bytes of the frame, up to the one that differs from the magic.
        found: Vec<u8>,
    },
    /// The peer speaks another version of this protocol.
    #[error(
        "the peer speaks protocol version {found}, this side speaks {VERSION}; bring the older one up to date"
    )]
    Version {
        /// Version in the peer's header.
        found: u16,
    },
    /// The first 24 bytes of the header were damaged.
    #[error("header checksum is {stated:#010x} but its bytes give {computed:#010x}")]
    HeaderChecksum {
        /// CRC-32C stated in the header.
        stated: u32,
        /// CRC-32C computed of the bytes that came.
        computed: u32,
    },
    /// A flag is set that this version does not define.
    #[error("reserved header flags are set: {flags:#010x}")]
    ReservedFlags {
        /// The flags word of the header.
        flags: u32,
    },
    /// The announced payload is over the limit; known before any of it has arrived.
    #[error("a payload of {payload_len} bytes is announced, the limit is {payload_len_max}")]
    PayloadTooLong {
        /// Payload length that the header announces, bytes.
        payload_len: u32,
        /// Payload length that the limits allow, bytes.
        payload_len_max: u32,
    },
    /// Header or payload were damaged.
    #[error("frame checksum is {stated:#010x} but its bytes give {computed:#010x}")]
    Checksum {
        /// CRC-32C stated in the header.
        stated: u32,
        /// CRC-32C computed of the bytes that came.
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
    /// The number of a rigid body's shape is not one that this version knows.
    #[error("a rigid body has the shape number {kind}; there are 0 to 4")]
    UnknownShape {
        /// Number of the shape in the payload.
        kind: u32,
    },
    /// An answer announces fields (of strain, stress, …) that do not exist for this kind of answer.
    #[error("an answer announces the fields {bits:#x}, of which some are not known")]
    UnknownFields {
        /// The fields in question, one bit for each; see [`Field::bit`](crate::Field::bit).
        bits: u32,
    },
    /// A mesh announces arrays that this version does not know.
    #[error(
        "a mesh announces the arrays {bits:#x}; there are region labels (1) and mid-edge nodes (2)"
    )]
    UnknownArrays {
        /// The arrays, one bit for each.
        bits: u8,
    },
    /// The kind in the header is the number of no message.
    #[error("unknown message kind {kind:#06x}")]
    UnknownKind {
        /// Number of the kind in the header.
        kind: u16,
    },
    /// A client's message where a server's is expected, or the other way round.
    #[error("{kind} travels in the other direction")]
    WrongDirection {
        /// Kind of the message that came.
        kind: Kind,
    },
    /// The part holds a value that does not exist (enum tag, boolean, text that is not UTF-8).
    #[error("the small part of the payload cannot be read: {source}")]
    Part {
        /// Error of the bincode decoder.
        source: wincode::ReadError,
    },
    /// The part is over [`PART_LEN_MAX`](crate::PART_LEN_MAX).
    #[error("the small part of the payload has {len} bytes, the limit is {}", crate::PART_LEN_MAX)]
    PartTooLong {
        /// Announced length of the part, bytes.
        len: u64,
    },
    /// A text is longer than allowed.
    #[error("{what} has {len} bytes, the limit is {len_max}")]
    TextTooLong {
        /// Name of the text's field.
        what: &'static str,
        /// Length of the text, bytes.
        len: usize,
        /// Length that the limits allow, bytes.
        len_max: u32,
    },
    /// A method's name holds other characters than it may.
    #[error(transparent)]
    MethodName(#[from] MethodNameError),
    /// An array announces more entries than allowed.
    #[error("{count} {what} are announced, the limit is {count_max}")]
    TooMany {
        /// Name of the array.
        what: &'static str,
        /// Entries that the part announces.
        count: u32,
        /// Entries that the limits allow.
        count_max: u32,
    },
    /// An array announces more entries than there are bytes.
    #[error("{what} need {needed} bytes, {there} are there")]
    ArrayCut {
        /// Name of the array.
        what: &'static str,
        /// Length of the announced entries, bytes.
        needed: u64,
        /// Bytes left in the payload.
        there: usize,
    },
    /// The lengths of the masks do not add up to the announced number of nodes of all masks.
    #[error("the masks are {lens_sum} nodes long in all, {entry_count} are announced")]
    MaskLengths {
        /// Sum of the lengths of the masks, in nodes.
        lens_sum: u64,
        /// Announced number of nodes of all masks together.
        entry_count: u32,
    },
    /// The numbers of triangles do not add up to the announced number of all.
    #[error("the pressures are on {lens_sum} triangles in all, {triangle_count} are announced")]
    PressureLengths {
        /// Sum of the numbers of triangles.
        lens_sum: u64,
        /// Announced number of all triangles.
        triangle_count: u32,
    },
    /// Padding bytes, which fill an array up to the next multiple of eight, are not zero.
    #[error("padding before byte {position} of the payload is not zero")]
    Padding {
        /// Offset of the end of the padding in the payload, bytes.
        position: usize,
    },
    /// Bytes are left after the last array.
    #[error("{count} bytes are left over at the end of the payload")]
    LeftOver {
        /// Number of bytes behind the last array.
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
        /// Error of the bincode encoder.
        source: wincode::WriteError,
    },
    /// The bincode part (texts, mostly) is too long.
    #[error("the small part has {len} bytes, the limit is {}", crate::PART_LEN_MAX)]
    PartTooLong {
        /// Length of the part, bytes.
        len: usize,
    },
    /// More payload than the limits of this message allow, or than 32 bits count.
    #[error("the payload has {len} bytes, the limit is {len_max}")]
    PayloadTooLong {
        /// Length of the payload, bytes.
        len: usize,
        /// Length that the limits allow, bytes.
        len_max: u32,
    },
    /// More entries than 32 bits count.
    #[error("{count} {what} are more than 32 bits count")]
    TooMany {
        /// Name of the array.
        what: &'static str,
        /// Number of entries of the array.
        count: usize,
    },
    /// Two lists that belong together differ in length.
    #[error("{count} {what} where {expected} are needed")]
    CountMismatch {
        /// Name of the array.
        what: &'static str,
        /// Number of entries of the array.
        count: usize,
        /// Number of entries that the other list requires.
        expected: usize,
    },
}

/// Why a frame could not be read from or written to a stream.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ConnectionError {
    /// The bytes that came are not this protocol, or were damaged or cut.
    #[error(transparent)]
    Frame(#[from] FrameError),
    /// The stream's read timeout passed; what has come is kept, reading may go on.
    #[error("no bytes within the read timeout, {received} bytes into a frame")]
    ReadTimedOut {
        /// Bytes of the unfinished frame that have come so far.
        received: usize,
    },
    /// The stream's write timeout passed; go on with `bytes[written..]` or give the stream up.
    #[error("the peer took no bytes within the write timeout, after {written} bytes")]
    WriteTimedOut {
        /// Number of bytes that the stream has taken.
        written: usize,
    },
    /// The peer closed while bytes were still to be written.
    #[error("the peer closed the stream after {written} bytes")]
    Closed {
        /// Number of bytes that the stream has taken.
        written: usize,
    },
    /// Any other error of the operating system.
    #[error("the stream failed: {0}")]
    Io(#[from] io::Error),
}

fn length(frame_len: Option<usize>) -> String {
    match frame_len {
        Some(len) => format!("{len}"),
        None => format!("at least {HEADER_LEN}"),
    }
}
