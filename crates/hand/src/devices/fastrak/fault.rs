//! The faults that bytes of the tracker's line can have.

/// Why bytes did not become a record; the first reason of a run of skipped bytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum FastrakFaultKind {
    /// A record starts with `0`, a reply with `2`.
    #[error("byte {byte:#04x} starts neither a record nor a reply")]
    UnexpectedByte {
        /// Byte that was found.
        byte: u8,
    },
    /// The second byte is no station.
    #[error("station byte {byte:#04x} is not '1' to '4'")]
    BadStation {
        /// Byte that was found.
        byte: u8,
    },
    /// The third byte is neither blank nor a letter.
    #[error("error byte {byte:#04x} is neither blank nor a letter")]
    BadErrorByte {
        /// Byte that was found.
        byte: u8,
    },
    /// No CR LF at the end of the record.
    #[error("the record does not end in CR LF")]
    BadTerminator,
    /// A field that no tracker sends.
    #[error("number {index} of the record cannot be true")]
    BadNumber {
        /// Position among the numbers of the record, from 0.
        index: usize,
    },
    /// It starts like a status or error record and does not go on like one.
    #[error("not a status or error record")]
    BadReply,
}

/// Bytes that were thrown away, and why the first of them was.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{kind} ({bytes_skipped} bytes skipped)")]
pub struct FastrakFault {
    /// Why the first of the bytes was thrown away.
    pub kind: FastrakFaultKind,
    /// Number of bytes that were thrown away.
    pub bytes_skipped: usize,
}
