//! The glove's replies to the queries of its set-up.

/// What stands between the echo of a query and its NUL.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Payload {
    /// So many bytes, zeros among them.
    Bytes(usize),
    /// Text up to the NUL.
    Text,
}

/// The reply to a query.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Reply {
    /// What it tells.
    Payload(Vec<u8>),
    /// The unit does not know the query.
    Refused,
}

/// The reply to the query `?` and `letter`, if it is among what was heard.
pub(super) fn find_reply(heard: &[u8], letter: u8, payload: Payload) -> Option<Reply> {
    let echo = [b'?', letter];
    let echoed = |at: &usize| heard[*at..].starts_with(&echo);
    for start in (0..heard.len()).filter(echoed) {
        let rest = &heard[start + echo.len()..];
        let length = match payload {
            Payload::Bytes(length) => length,
            Payload::Text => rest.iter().position(|&byte| byte == 0).unwrap_or(rest.len()),
        };
        if rest.get(length) == Some(&0) {
            return Some(Reply::Payload(rest[..length].to_vec()));
        }
    }
    heard.windows(3).any(|window| window == b"e?\0").then_some(Reply::Refused)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn replies_are_found_with_zeros_in_them_and_behind_other_bytes() {
        let bytes = Payload::Bytes;
        let payload = |bytes: &[u8]| Some(Reply::Payload(bytes.to_vec()));
        assert_eq!(find_reply(b"?S\x16\0", b'S', bytes(1)), payload(b"\x16"));
        assert_eq!(find_reply(b"\x03\0G12?R\0\0", b'R', bytes(1)), payload(b"\0"));
        assert_eq!(find_reply(b"?K\0\x01\x02\0", b'K', bytes(3)), payload(b"\0\x01\x02"));
        assert_eq!(
            find_reply(b"?i CyberGlove\r\n\0", b'i', Payload::Text),
            payload(b" CyberGlove\r\n")
        );
        assert_eq!(find_reply(b"e?\0", b'i', Payload::Text), Some(Reply::Refused));
        for part in [&b""[..], b"?", b"?S", b"?S\x16", b"?S\x16\x05", b"e?"] {
            assert_eq!(find_reply(part, b'S', bytes(1)), None, "{part:?}");
        }
        assert_eq!(find_reply(b"?i text", b'i', Payload::Text), None);
    }
}
