//! The refusal of a request: a code and a text.

use std::fmt;

use wincode::{SchemaRead, SchemaWrite};

use crate::header::Header;
use crate::payload::{PayloadReader, PayloadWriter};
use crate::{DecodeError, EncodeError, Kind, Limits};

/// Reason of a refusal; the numbers are part of the format and never change.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum RejectCode {
    /// The message does not decode, or its content makes no sense (index out of range, NaN, …).
    BadRequest,
    /// No model has this hash here; upload it.
    UnknownModel,
    /// The known displacements leave the body, or a part of it, free to move rigidly.
    RigidMotionFree,
    /// Mesh or request over a limit of the server.
    TooLarge,
    /// Too many sessions or requests; try again later.
    Busy,
    /// Token missing or wrong.
    NotAuthorised,
    /// No method has this name.
    UnknownMethod,
    /// The stiffness matrix of the free degrees of freedom is not positive definite.
    NotPositiveDefinite,
    /// The solve would need more memory than the server may use.
    MemoryLimit,
    /// The answer could not be computed before its deadline.
    Deadline,
    /// The server is about to end.
    ShuttingDown,
    /// The server is at fault.
    Internal,
    /// The server does not speak the client's protocol version.
    UnsupportedVersion,
    /// The answer would have no certain digit: what is known holds the body too weakly, or, with
    /// large deformation, no equilibrium was found.
    Uncertain,
    /// The client has cancelled the request.
    Cancelled,
    /// A newer request of the client has made this one needless.
    Superseded,
    /// The processes that answer together have gone; the server asked twice.
    ClusterLost,
    /// A reason that this version of the crate does not know, by its number.
    Other(u16),
}

impl RejectCode {
    /// All codes that this version knows, in the order of their numbers, which count from 1.
    pub const ALL: [Self; 17] = [
        Self::BadRequest,
        Self::UnknownModel,
        Self::RigidMotionFree,
        Self::TooLarge,
        Self::Busy,
        Self::NotAuthorised,
        Self::UnknownMethod,
        Self::NotPositiveDefinite,
        Self::MemoryLimit,
        Self::Deadline,
        Self::ShuttingDown,
        Self::Internal,
        Self::UnsupportedVersion,
        Self::Uncertain,
        Self::Cancelled,
        Self::Superseded,
        Self::ClusterLost,
    ];

    /// Number of the code on the wire.
    pub fn number(self) -> u16 {
        match self {
            Self::Other(number) => number,
            known => Self::ALL.iter().take_while(|code| **code != known).count() as u16 + 1,
        }
    }

    /// Code with this number; [`Other`](Self::Other) if it is not known.
    pub fn from_number(number: u16) -> Self {
        let known = usize::from(number).checked_sub(1).and_then(|at| Self::ALL.get(at));
        known.copied().unwrap_or(Self::Other(number))
    }
}

impl fmt::Display for RejectCode {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        fmt::Debug::fmt(self, f)
    }
}

/// Refusal of a request; the session goes on.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Rejected {
    /// Reason as a code, for the program.
    pub code: RejectCode,
    /// Reason in one line, for the user.
    pub text: String,
    /// Further detail for the log; may be empty.
    pub detail: String,
    /// Time after which to ask again; 0 where the server does not know it, or where asking again is of no
    /// use.
    ///
    /// Units: ms.
    pub retry_after_ms: u32,
}

#[derive(Clone, Debug, SchemaRead, SchemaWrite)]
struct RejectedPart {
    code: u16,
    text: String,
    detail: String,
    retry_after_ms: u32,
}

/// Versions before parts had a length: code, text and detail stand at the payload's beginning.
const VERSIONS_WITHOUT_LENGTH: std::ops::RangeInclusive<u16> = 1..=3;

impl Rejected {
    /// A refusal with code and text, without detail.
    pub fn new(code: RejectCode, text: impl Into<String>) -> Self {
        Self { code, text: text.into(), detail: String::new(), retry_after_ms: 0 }
    }

    /// Frame with request id 0 that a peer of another version of the wire can read, as far as that
    /// version is known; else in this version's form.
    pub fn encode_for_version(&self, version: u16) -> Vec<u8> {
        let mut fields = self.code.number().to_le_bytes().to_vec();
        for text in [&self.text, &self.detail] {
            fields.extend((text.len() as u64).to_le_bytes());
            fields.extend(text.as_bytes());
        }
        let mut payload = Vec::new();
        let has_length = !VERSIONS_WITHOUT_LENGTH.contains(&version);
        if has_length {
            fields.extend(self.retry_after_ms.to_le_bytes());
            payload.extend((fields.len() as u64).to_le_bytes());
        }
        payload.extend(fields);
        payload.resize(payload.len().next_multiple_of(8), 0);
        let version = if has_length { crate::VERSION } else { version };
        let kind = Kind::Rejected.number();
        let header = Header::encode_as(version, kind, 0, payload.len() as u32, &payload);
        [&header[..], &payload].concat()
    }

    pub(super) fn write(&self, writer: &mut PayloadWriter<'_>) -> Result<(), EncodeError> {
        writer.part(&RejectedPart {
            code: self.code.number(),
            text: self.text.clone(),
            detail: self.detail.clone(),
            retry_after_ms: self.retry_after_ms,
        })
    }

    pub(super) fn read(
        reader: &mut PayloadReader<'_>,
        limits: &Limits,
    ) -> Result<Self, DecodeError> {
        let RejectedPart { code, text, detail, retry_after_ms } = reader.part()?;
        limits.check_text("text of the refusal", &text)?;
        limits.check_text("detail of the refusal", &detail)?;
        Ok(Self { code: RejectCode::from_number(code), text, detail, retry_after_ms })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{FrameBuffer, Reply};

    #[test]
    fn every_number_is_a_code_and_comes_back() {
        for (at, code) in RejectCode::ALL.into_iter().enumerate() {
            assert_eq!(usize::from(code.number()), at + 1);
        }
        for number in 0..=u16::MAX {
            assert_eq!(RejectCode::from_number(number).number(), number);
        }
        assert_eq!(RejectCode::from_number(14), RejectCode::Uncertain);
        assert_eq!(RejectCode::from_number(900), RejectCode::Other(900));
    }

    #[test]
    fn refusal_for_another_version_is_in_the_form_of_that_version() {
        let rejected = Rejected::new(RejectCode::UnsupportedVersion, "too old");
        let bytes = rejected.encode_for_version(3);
        assert_eq!(u16::from_le_bytes([bytes[4], bytes[5]]), 3);
        let mut payload = vec![13, 0, 7, 0, 0, 0, 0, 0, 0, 0];
        payload.extend(b"too old");
        payload.extend([0; 8]);
        payload.resize(payload.len().next_multiple_of(8), 0);
        assert_eq!(&bytes[crate::HEADER_LEN..], payload);
        let mut buffer = FrameBuffer::new(Limits::default());
        buffer.feed(&rejected.encode_for_version(99));
        let frame = buffer.next_frame().unwrap().unwrap();
        assert_eq!(Reply::decode(&frame, &Limits::default()).unwrap(), Reply::Rejected(rejected));
    }
}
