//! The refusal of a request: a code and a text.

use std::fmt;

use wincode::{SchemaRead, SchemaWrite};

use crate::{DecodeError, Limits};

/// Reason of a refusal; the numbers are part of the format and never change.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, SchemaRead, SchemaWrite)]
#[wincode(tag_encoding = "u16")]
#[repr(u16)]
pub enum RejectCode {
    /// The message does not decode, or its content makes no sense (index out of range, NaN, …).
    #[wincode(tag = 1)]
    BadRequest = 1,
    /// No model has this hash here; upload it.
    #[wincode(tag = 2)]
    UnknownModel = 2,
    /// The known displacements leave the body, or a part of it, free to move rigidly.
    #[wincode(tag = 3)]
    RigidMotionFree = 3,
    /// Mesh or request over a limit of the server.
    #[wincode(tag = 4)]
    TooLarge = 4,
    /// Too many sessions or requests; try again later.
    #[wincode(tag = 5)]
    Busy = 5,
    /// Token missing or wrong.
    #[wincode(tag = 6)]
    NotAuthorised = 6,
    /// No method has this name.
    #[wincode(tag = 7)]
    UnknownMethod = 7,
    /// The stiffness matrix of the free degrees of freedom is not positive definite.
    #[wincode(tag = 8)]
    NotPositiveDefinite = 8,
    /// The solve would need more memory than the server may use.
    #[wincode(tag = 9)]
    MemoryLimit = 9,
    /// The answer could not be had in time.
    #[wincode(tag = 10)]
    Deadline = 10,
    /// The server is about to end.
    #[wincode(tag = 11)]
    ShuttingDown = 11,
    /// The server is at fault.
    #[wincode(tag = 12)]
    Internal = 12,
    /// The server does not speak the client's protocol version.
    #[wincode(tag = 13)]
    UnsupportedVersion = 13,
    /// The answer would have no certain digit: what is known holds the body too weakly, or, with
    /// large deformation, no equilibrium was found.
    #[wincode(tag = 14)]
    Uncertain = 14,
}

impl RejectCode {
    /// All codes, in the order of their numbers.
    pub const ALL: [Self; 14] = [
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
    ];

    /// Number on the wire.
    pub const fn number(self) -> u16 {
        self as u16
    }
}

impl fmt::Display for RejectCode {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        fmt::Debug::fmt(self, f)
    }
}

/// The request is not granted; the session goes on.
#[derive(Clone, Debug, PartialEq, Eq, SchemaRead, SchemaWrite)]
pub struct Rejected {
    /// Why, for the program.
    pub code: RejectCode,
    /// Why, for the user; one line.
    pub text: String,
    /// Anything more, for the log; may be empty.
    pub detail: String,
}

impl Rejected {
    pub(super) fn check(&self, limits: &Limits) -> Result<(), DecodeError> {
        limits.check_text("text of the refusal", &self.text)?;
        limits.check_text("detail of the refusal", &self.detail)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_on_the_wire_are_the_numbers_of_the_enum() {
        for code in RejectCode::ALL {
            assert_eq!(wincode::serialize(&code).unwrap(), code.number().to_le_bytes());
        }
        let mut known = 0;
        for number in 0..=u16::MAX {
            match wincode::deserialize::<RejectCode>(&number.to_le_bytes()) {
                Ok(code) => {
                    assert_eq!(code.number(), number);
                    known += 1;
                }
                Err(error) => assert!(matches!(error, wincode::ReadError::InvalidTagEncoding(_))),
            }
        }
        assert_eq!(known, RejectCode::ALL.len());
    }
}
