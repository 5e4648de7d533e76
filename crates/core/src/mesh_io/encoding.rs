//! Encoded bytes: base64 as VTU uses it (several encodings one after another, each with its own padding),
//! and files that gzip has packed.

use std::io::Read;

use flate2::read::MultiGzDecoder;

use super::companion::Companion;
use super::error::{Fault, MeshFileError, Place};

const ALPHABET: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";

/// First `limit` bytes of the text's meaning, or fewer where the text ends (or is not base64).
///
/// Padding ends a group of four characters, not the text: VTU files have a header that is encoded
/// on its own, followed by the data.
pub(super) fn decode(text: &[u8], limit: usize) -> Vec<u8> {
    let mut bytes = Vec::with_capacity(limit.min(text.len() / 4 * 3));
    let mut bits = 0_u32;
    let mut characters = 0;
    let mut padding = 0;
    for &character in text.iter().filter(|byte| !byte.is_ascii_whitespace()) {
        let value = match character {
            b'A'..=b'Z' => character - b'A',
            b'a'..=b'z' => character - b'a' + 26,
            b'0'..=b'9' => character - b'0' + 52,
            b'+' => 62,
            b'/' => 63,
            b'=' => {
                padding += 1;
                0
            }
            _ => break,
        };
        bits = bits << 6 | u32::from(value);
        characters += 1;
        if characters == 4 {
            let [_, group @ ..] = bits.to_be_bytes();
            bytes.extend_from_slice(&group[..3_usize.saturating_sub(padding)]);
            (bits, characters, padding) = (0, 0, 0);
            if bytes.len() >= limit {
                bytes.truncate(limit);
                break;
            }
        }
    }
    bytes
}

/// Base64 text of the bytes, padded.
pub(super) fn encode(bytes: &[u8]) -> Vec<u8> {
    let mut text = Vec::with_capacity(bytes.len().div_ceil(3) * 4);
    for group in bytes.chunks(3) {
        let mut padded = [0; 4];
        padded[1..=group.len()].copy_from_slice(group);
        let bits = u32::from_be_bytes(padded);
        for (i, shift) in [18, 12, 6, 0].into_iter().enumerate() {
            let character = ALPHABET[(bits >> shift & 63) as usize];
            text.push(if i > group.len() { b'=' } else { character });
        }
    }
    text
}

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
    use std::io::Write;

    use flate2::Compression;
    use flate2::write::GzEncoder;
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn known_texts_are_understood() {
        assert_eq!(decode(b"U29mdA==", 99), b"Soft");
        assert_eq!(encode(b"Softgrasp"), b"U29mdGdyYXNw");
        assert_eq!(decode(b" U2 9m\ndA==Z3Jhc3A=", 99), b"Softgrasp");
        assert_eq!(decode(b"U29mdA==", 2), b"So");
        assert_eq!(decode(b"U29m<", 99), b"Sof");
        assert_eq!(decode(b"====", 99), b"");
    }

    proptest! {
        #[test]
        fn what_is_encoded_comes_back(bytes in proptest::collection::vec(any::<u8>(), 0..50)) {
            prop_assert_eq!(decode(&encode(&bytes), usize::MAX), bytes);
        }
    }

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
