//! Base64 as VTU uses it: several encodings one after another, each with its own padding.

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

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

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
}
