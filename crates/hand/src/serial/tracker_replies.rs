//! The tracker's replies to the commands of its set-up.

use crate::devices::fastrak::{Encoding, FastrakFormat, LengthUnit};

/// The status record among what was heard, without CR LF.
pub(super) fn find_status(heard: &[u8]) -> Option<String> {
    lines(heard).find(|line| line.get(2) == Some(&b'S') && is_reply(line)).map(text)
}

/// What a status record says that a tracker is not as it was told to be: text or floats, and the
/// unit. `None` where all is as it was told, or the record does not say.
pub(super) fn disobeyed(status: &str, told: FastrakFormat) -> Option<String> {
    let bits = u16::from_str_radix(status.get(3..6)?, 16).ok()?;
    let is_binary = bits & 1 != 0;
    let units = if bits & 2 != 0 { LengthUnit::Centimetres } else { LengthUnit::Inches };
    if units != told.units {
        let (is, was_told) = (units.name(), told.units.name());
        return Some(format!("it stays in {is} though it was told to send {was_told}"));
    }
    (is_binary != (told.encoding == Encoding::Binary))
        .then(|| "it did not take the order for text or bytes".to_owned())
}

/// The error records among what was heard.
pub(super) fn complaints(heard: &[u8]) -> Vec<String> {
    let complains = |line: &&[u8]| is_reply(line) && line.windows(7).any(|w| w == b"*ERROR*");
    lines(heard).filter(complains).map(text).collect()
}

fn text(line: &[u8]) -> String {
    String::from_utf8_lossy(line).trim_end().to_owned()
}

/// Lines that have ended, from the last byte on that could begin a reply.
fn lines(heard: &[u8]) -> impl Iterator<Item = &[u8]> {
    let mut rest = heard;
    std::iter::from_fn(move || {
        let end = rest.windows(2).position(|pair| pair == b"\r\n")?;
        let line = &rest[..end];
        rest = &rest[end + 2..];
        // Garbage may stand before it.
        let start = (0..line.len()).find(|&at| is_reply(&line[at..])).unwrap_or(0);
        Some(&line[start..])
    })
}

fn is_reply(line: &[u8]) -> bool {
    matches!(line, [b'2', b' ' | b'1'..=b'4', letter, ..] if letter.is_ascii_alphabetic())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::devices::fastrak::OutputList;

    #[test]
    fn status_tells_a_tracker_that_was_left_in_inches() {
        let told = FastrakFormat {
            encoding: Encoding::Binary,
            output: OutputList::PositionQuaternion,
            units: LengthUnit::Centimetres,
        };
        assert_eq!(disobeyed("21S3F3    F31  2.10", told), None);
        let inches = disobeyed("21S3F1    F31  2.10", told).expect("said");
        assert_eq!(inches, "it stays in inches though it was told to send centimetres");
        assert!(disobeyed("21S3F2    F31  2.10", told).is_some_and(|why| why.contains("text")));
        for unclear in ["", "21S", "21SXYZ", "21Sé"] {
            assert_eq!(disobeyed(unclear, told), None, "{unclear}");
        }
    }

    #[test]
    fn status_and_complaints_are_found_among_other_bytes() {
        let heard = b".00\r\nxx21S3F0    F31  2.10  \r\n2 E*ERROR*O*ERROR* EC -3*\r\n01  ";
        assert_eq!(find_status(heard).as_deref(), Some("21S3F0    F31  2.10"));
        assert_eq!(complaints(heard), ["2 E*ERROR*O*ERROR* EC -3*"]);
        for heard in [&b""[..], b"21S3F0", b"\r\n", b"2\r\n", b"01   10.25\r\n"] {
            assert_eq!(find_status(heard), None, "{heard:?}");
            assert!(complaints(heard).is_empty());
        }
    }
}
