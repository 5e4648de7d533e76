//! The tracker's replies to the commands of its set-up.

/// The status record among what was heard, without CR LF.
pub(super) fn find_status(heard: &[u8]) -> Option<String> {
    lines(heard).find(|line| line.get(2) == Some(&b'S') && is_reply(line)).map(text)
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
