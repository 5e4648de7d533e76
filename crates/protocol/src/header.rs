//! The header of a frame: the 32 bytes before every payload.

use crate::format::{HEADER_LEN, MAGIC, VERSION};
use crate::{FrameError, Limits};

/// Decoded header of a frame. The kind stays a number, since an unknown kind in a sound frame is a bad
/// request and not a bad stream.
///
/// Layout, little-endian: `0` magic, `4` version u16, `6` kind u16, `8` flags u32 (all reserved,
/// zero), `12` payload length u32, `16` request id u64, `24` CRC-32C of bytes 0..24, `28` CRC-32C
/// of bytes 0..28 and the payload. The first checksum makes a damaged length an error at once; with
/// the second one alone the reader would wait for bytes that never come.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Header {
    /// Number of the kind of message, see [`Kind`](crate::Kind).
    pub kind: u16,
    /// Request id: chosen by the client, repeated in the reply; 0 where the server speaks without a
    /// request.
    pub request_id: u64,
    /// Length of the payload behind the header, bytes.
    pub payload_len: u32,
    /// CRC-32C of bytes 0..28 and the payload.
    pub frame_crc: u32,
}

impl Header {
    /// The 32 bytes of the header that precede `payload`.
    ///
    /// Shapes: `payload_len` is the length of `payload`, which the caller has checked to fit.
    pub(crate) fn encode(
        kind: u16,
        request_id: u64,
        payload_len: u32,
        payload: &[u8],
    ) -> [u8; HEADER_LEN] {
        Self::encode_as(VERSION, kind, request_id, payload_len, payload)
    }

    /// Header bytes in another version of the format, whose header has the same layout.
    pub(crate) fn encode_as(
        version: u16,
        kind: u16,
        request_id: u64,
        payload_len: u32,
        payload: &[u8],
    ) -> [u8; HEADER_LEN] {
        let mut raw = [0; HEADER_LEN];
        raw[0..4].copy_from_slice(&MAGIC);
        raw[4..6].copy_from_slice(&version.to_le_bytes());
        raw[6..8].copy_from_slice(&kind.to_le_bytes());
        raw[12..16].copy_from_slice(&payload_len.to_le_bytes());
        raw[16..24].copy_from_slice(&request_id.to_le_bytes());
        let header_crc = crc32c::crc32c(&raw[..24]);
        raw[24..28].copy_from_slice(&header_crc.to_le_bytes());
        let frame_crc = crc32c::crc32c_append(crc32c::crc32c(&raw[..28]), payload);
        raw[28..32].copy_from_slice(&frame_crc.to_le_bytes());
        raw
    }

    /// Decodes a header; also the CRC-32C of bytes 0..28, to be continued over the payload.
    ///
    /// # Errors
    /// [`FrameError`] for another magic or version, a wrong checksum, reserved flags or a payload over
    /// the limit, in this order: another version may lay out the rest differently.
    pub(crate) fn decode(
        raw: &[u8; HEADER_LEN],
        limits: &Limits,
    ) -> Result<(Self, u32), FrameError> {
        check_magic(raw)?;
        let version = u16::from_le_bytes(bytes_at(raw, 4));
        if version != VERSION {
            return Err(FrameError::Version { found: version });
        }
        let stated = u32::from_le_bytes(bytes_at(raw, 24));
        let computed = crc32c::crc32c(&raw[..24]);
        if stated != computed {
            return Err(FrameError::HeaderChecksum { stated, computed });
        }
        let flags = u32::from_le_bytes(bytes_at(raw, 8));
        if flags != 0 {
            return Err(FrameError::ReservedFlags { flags });
        }
        let payload_len = u32::from_le_bytes(bytes_at(raw, 12));
        let payload_len_max = limits.payload_len_max;
        if payload_len > payload_len_max {
            return Err(FrameError::PayloadTooLong { payload_len, payload_len_max });
        }
        let header = Self {
            kind: u16::from_le_bytes(bytes_at(raw, 6)),
            request_id: u64::from_le_bytes(bytes_at(raw, 16)),
            payload_len,
            frame_crc: u32::from_le_bytes(bytes_at(raw, 28)),
        };
        Ok((header, crc32c::crc32c(&raw[..28])))
    }

    /// Length of the whole frame, header included, bytes.
    pub fn frame_len(&self) -> usize {
        HEADER_LEN + self.payload_len as usize
    }
}

/// `Ok` if the first bytes of a frame, however few have come, agree with the magic.
///
/// # Errors
/// [`FrameError::Magic`] at the first byte that differs.
pub(crate) fn check_magic(bytes: &[u8]) -> Result<(), FrameError> {
    match bytes.iter().zip(&MAGIC).position(|(found, expected)| found != expected) {
        Some(at) => Err(FrameError::Magic { found: bytes.iter().take(at + 1).copied().collect() }),
        None => Ok(()),
    }
}

/// `N` bytes from a constant offset inside the header.
fn bytes_at<const N: usize>(raw: &[u8; HEADER_LEN], at: usize) -> [u8; N] {
    std::array::from_fn(|i| raw[at + i])
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Bit-by-bit CRC-32C (reflected polynomial 0x82f63b78), the oracle for the fast one.
    fn naive_crc32c(bytes: &[u8]) -> u32 {
        let mut crc = u32::MAX;
        for byte in bytes {
            crc ^= u32::from(*byte);
            for _ in 0..8 {
                crc = if crc & 1 == 1 { (crc >> 1) ^ 0x82f6_3b78 } else { crc >> 1 };
            }
        }
        !crc
    }

    fn reseal(raw: &mut [u8; HEADER_LEN]) {
        let crc = naive_crc32c(&raw[..24]);
        raw[24..28].copy_from_slice(&crc.to_le_bytes());
        let crc = naive_crc32c(&raw[..28]);
        raw[28..32].copy_from_slice(&crc.to_le_bytes());
    }

    #[test]
    fn both_checksums_equal_the_bitwise_ones() {
        assert_eq!(naive_crc32c(b"123456789"), 0xe306_9283, "the check value of CRC-32C");
        let payload = [7, 8, 9, 10, 11];
        let raw = Header::encode(8, 99, 5, &payload);
        let header_crc = u32::from_le_bytes(bytes_at(&raw, 24));
        assert_eq!(header_crc, naive_crc32c(&raw[..24]));
        let (header, _) = Header::decode(&raw, &Limits::default()).unwrap();
        assert_eq!(header.frame_crc, naive_crc32c(&[&raw[..28], &payload].concat()));
    }

    #[test]
    fn header_comes_back_as_written() {
        let raw = Header::encode(0x8002, u64::MAX - 1, 0, &[]);
        let (header, _) = Header::decode(&raw, &Limits::default()).unwrap();
        assert_eq!((header.kind, header.request_id, header.payload_len), (0x8002, u64::MAX - 1, 0));
    }

    #[test]
    fn each_field_has_its_own_error() {
        let limits = Limits { payload_len_max: 100, ..Limits::default() };
        let good = Header::encode(8, 1, 100, &[]);
        let fault = |at: usize, value: u8, seal: bool| {
            let mut raw = good;
            raw[at] = value;
            if seal {
                reseal(&mut raw);
            }
            Header::decode(&raw, &limits).unwrap_err()
        };
        assert_eq!(fault(2, b'X', true), FrameError::Magic { found: b"SGX".to_vec() });
        assert_eq!(fault(4, 1, true), FrameError::Version { found: 1 });
        assert!(matches!(fault(6, 9, false), FrameError::HeaderChecksum { .. }));
        assert_eq!(fault(9, 1, true), FrameError::ReservedFlags { flags: 0x100 });
        let too_long = FrameError::PayloadTooLong { payload_len: 101, payload_len_max: 100 };
        assert_eq!(fault(12, 101, true), too_long);
        assert!(Header::decode(&good, &limits).is_ok(), "a payload at the limit is allowed");
    }
}
