//! Unpacks gzip, up to a limit: a small file can unpack to anything.

use std::io::Read;

use flate2::read::MultiGzDecoder;

use super::companion::Companion;
use super::error::{Fault, MeshFileError, Place};

/// The text of a mesh that can be modelled is shorter, its companions included.
const MAX_UNPACKED_BYTES: usize = 1 << 29;

/// The format of a file is told by so many bytes of its beginning.
const BEGINNING: u64 = 1 << 16;

/// Whether the bytes begin as gzip does.
pub(super) fn is_gzip(bytes: &[u8]) -> bool {
    bytes.starts_with(b"\x1f\x8b")
}

/// The first bytes of what is packed, as far as they are sound.
pub(super) fn beginning(bytes: &[u8]) -> Vec<u8> {
    let mut begin = Vec::new();
    // What comes before the damage is kept.
    let _ = MultiGzDecoder::new(bytes).take(BEGINNING).read_to_end(&mut begin);
    begin
}

/// Bytes that a file and its companions may still take when unpacked.
#[derive(Debug)]
pub(super) struct Unpacker {
    left: usize,
    /// What was wrong with a companion.
    pub(super) fault: Option<MeshFileError>,
}

impl Default for Unpacker {
    fn default() -> Self {
        Self { left: MAX_UNPACKED_BYTES, fault: None }
    }
}

impl Unpacker {
    /// All that is packed in a gzip file.
    ///
    /// # Errors
    /// [`MeshFileError`] for file `name`: the packed data is damaged, or more than the limit.
    pub(super) fn unpack(&mut self, name: &str, bytes: &[u8]) -> Result<Vec<u8>, MeshFileError> {
        let refuse = |fault| MeshFileError { file: name.to_owned(), fault };
        let limit = u64::try_from(self.left).unwrap_or(u64::MAX).saturating_add(1);
        let mut unpacked = Vec::new();
        let read = MultiGzDecoder::new(bytes).take(limit).read_to_end(&mut unpacked);
        if let Err(error) = read {
            let (expected, found) = ("sound gzip data".to_owned(), error.to_string());
            return Err(refuse(Fault::Syntax { at: Place::Byte(0), expected, found }));
        }
        if unpacked.len() > self.left {
            return Err(refuse(Fault::Count {
                at: Place::Byte(0),
                array: "unpacked gzip data".to_owned(),
                expected: format!("at most {} bytes", self.left),
                found: "more".to_owned(),
            }));
        }
        self.left -= unpacked.len();
        Ok(unpacked)
    }

    /// The bytes of a companion, unpacked if need be; a fault is kept.
    pub(super) fn companion(&mut self, wanted: &Companion, bytes: Vec<u8>) -> Option<Vec<u8>> {
        if !is_gzip(&bytes) {
            return Some(bytes);
        }
        match self.unpack(&wanted.to_string(), &bytes) {
            Ok(unpacked) => Some(unpacked),
            Err(fault) => {
                self.fault = Some(fault);
                None
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use flate2::Compression;
    use flate2::write::GzEncoder;
    use std::io::Write;

    fn packed(bytes: &[u8]) -> Vec<u8> {
        let mut encoder = GzEncoder::new(Vec::new(), Compression::best());
        encoder.write_all(bytes).unwrap();
        encoder.finish().unwrap()
    }

    #[test]
    fn what_is_packed_comes_out_whole_or_not_at_all() {
        let twice = [packed(b"one "), packed(b"two")].concat();
        assert_eq!(Unpacker::default().unpack("f", &twice).unwrap(), b"one two");
        for length in 0..packed(b"softgrasp").len() {
            let cut = packed(b"softgrasp")[..length].to_vec();
            let error = Unpacker::default().unpack("f", &cut).unwrap_err().to_string();
            assert!(error.starts_with("f: byte 0: expected sound gzip data, found "), "{error}");
        }
    }

    #[test]
    fn what_would_unpack_to_more_than_the_limit_is_refused() {
        let mut unpacker = Unpacker { left: 1000, fault: None };
        assert_eq!(unpacker.unpack("f", &packed(&[0; 600])).unwrap().len(), 600);
        let error = unpacker.unpack("f", &packed(&[0; 401])).unwrap_err().to_string();
        assert_eq!(error, "f: byte 0: unpacked gzip data: expected at most 400 bytes, found more");
        assert_eq!(beginning(&packed(&[7; 1 << 20])), vec![7; 1 << 16]);
    }
}
