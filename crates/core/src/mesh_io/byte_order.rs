//! Byte order of binary numbers.

use super::cursor::Cursor;
use super::error::MeshFileError;

/// Order of the bytes of a number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum ByteOrder {
    Little,
    Big,
}

impl ByteOrder {
    /// 32-bit integer.
    pub(super) fn i32(self, bytes: [u8; 4]) -> i32 {
        match self {
            Self::Little => i32::from_le_bytes(bytes),
            Self::Big => i32::from_be_bytes(bytes),
        }
    }

    /// Unsigned 64-bit integer.
    pub(super) fn u64(self, bytes: [u8; 8]) -> u64 {
        match self {
            Self::Little => u64::from_le_bytes(bytes),
            Self::Big => u64::from_be_bytes(bytes),
        }
    }

    /// Double precision number.
    pub(super) fn f64(self, bytes: [u8; 8]) -> f64 {
        f64::from_bits(self.u64(bytes))
    }

    /// Next 32-bit integer of a file.
    pub(super) fn next_i32(self, cursor: &mut Cursor, what: &str) -> Result<i64, MeshFileError> {
        cursor.take_array(what).map(|bytes| i64::from(self.i32(bytes)))
    }

    /// Next double precision number of a file.
    pub(super) fn next_f64(self, cursor: &mut Cursor, what: &str) -> Result<f64, MeshFileError> {
        cursor.take_array(what).map(|bytes| self.f64(bytes))
    }
}
