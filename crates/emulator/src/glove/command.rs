//! Cuts what the client sends to the glove into commands.

/// A command of the client to the interface unit.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Command {
    /// `G` or `g`: one record, in text or not.
    Poll { text: bool },
    /// `S` or `s`: records until [`Command::Stop`].
    Stream { text: bool },
    /// Ctrl-C: ends a stream.
    Stop,
    /// Ctrl-I: initialises the unit again.
    Reinitialise,
    /// Ctrl-R: starts the firmware again.
    Restart,
    /// `?` and a letter, or a small letter and `?`.
    Query { letter: u8, small: bool },
    /// A capital letter and its bytes.
    SetBytes { letter: u8, bytes: Vec<u8> },
    /// A small letter and its decimal numbers.
    SetNumbers { letter: u8, numbers: Vec<u32> },
    /// A command that the unit does not know.
    Unknown,
    /// A command with more numbers, or longer ones, than any has.
    TooManyNumbers,
    /// The end of a line that a command did not need.
    Nothing,
}

/// Longest line of text, without its end.
const LINE_LIMIT: usize = 80;

/// The first command of `bytes` and its length, `None` while it is incomplete.
pub(super) fn next_command(bytes: &[u8]) -> Option<(Command, usize)> {
    let &first = bytes.first()?;
    let found = match first {
        0x03 => (Command::Stop, 1),
        0x09 => (Command::Reinitialise, 1),
        0x12 => (Command::Restart, 1),
        b'G' | b'g' => (Command::Poll { text: first == b'g' }, 1),
        b'S' | b's' => (Command::Stream { text: first == b's' }, 1),
        b'?' => (Command::Query { letter: *bytes.get(1)?, small: false }, 2),
        b'\r' | b'\n' => (Command::Nothing, 1),
        b'a'..=b'z' if max_numbers(first).is_some() => return line(bytes, first),
        _ => match byte_count(bytes)? {
            Some(count) => {
                let bytes = bytes.get(1..1 + count)?.to_vec();
                (Command::SetBytes { letter: first, bytes }, 1 + count)
            }
            None => (Command::Unknown, 1),
        },
    };
    Some(found)
}

/// Bytes behind a capital letter; `Some(None)` if there is no such command, `None` while it cannot
/// be told.
fn byte_count(bytes: &[u8]) -> Option<Option<usize>> {
    Some(match bytes.first()? {
        b'B' | b'D' | b'F' | b'J' | b'L' | b'N' | b'Q' | b'U' | b'W' => Some(1),
        b'M' | b'P' => Some(3),
        b'T' => Some(4),
        // All sensors, or one of them with its value.
        b'C' => match bytes.get(1)? {
            b'A' => Some(1),
            b'O' | b'G' => Some(3),
            _ => None,
        },
        _ => None,
    })
}

/// Most numbers behind a small letter, `None` if there is no such command.
fn max_numbers(letter: u8) -> Option<usize> {
    match letter {
        b'd' | b'f' | b'j' | b'l' | b'n' | b'q' | b'u' | b'w' => Some(1),
        b't' => Some(2),
        b'm' | b'p' => Some(3),
        _ => None,
    }
}

/// A small letter, numbers, CR.
fn line(bytes: &[u8], letter: u8) -> Option<(Command, usize)> {
    let ends = |byte: &u8| matches!(byte, b'\r' | 0x03);
    let Some(end) = bytes.iter().take(LINE_LIMIT).position(ends) else {
        // The line is thrown away as far as it goes; what comes is the next command.
        return (bytes.len() >= LINE_LIMIT).then_some((Command::TooManyNumbers, LINE_LIMIT));
    };
    let length = end + 1;
    if bytes[end] == 0x03 {
        return Some((Command::Stop, length));
    }
    let text = std::str::from_utf8(&bytes[1..end]).unwrap_or("not text").trim();
    if text == "?" {
        return Some((Command::Query { letter: letter.to_ascii_uppercase(), small: true }, length));
    }
    let numbers: Result<Vec<u32>, _> = text.split_ascii_whitespace().map(str::parse).collect();
    let command = match numbers {
        Ok(numbers) if numbers.len() > max_numbers(letter).unwrap_or(0) => Command::TooManyNumbers,
        Ok(numbers) if !numbers.is_empty() => Command::SetNumbers { letter, numbers },
        _ => Command::Unknown,
    };
    Some((command, length))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn only(bytes: &[u8]) -> Command {
        let (command, length) = next_command(bytes).unwrap();
        assert_eq!(length, bytes.len(), "{bytes:?}");
        command
    }

    #[test]
    fn both_forms_of_every_command_are_understood() {
        assert_eq!(only(b"G"), Command::Poll { text: false });
        assert_eq!(only(b"s"), Command::Stream { text: true });
        assert_eq!(only(b"\x03"), Command::Stop);
        assert_eq!(only(b"?S"), Command::Query { letter: b'S', small: false });
        assert_eq!(only(b"l ?\r"), Command::Query { letter: b'L', small: true });
        assert_eq!(only(b"D\x01"), Command::SetBytes { letter: b'D', bytes: vec![1] });
        assert_eq!(
            only(b"M\x3f\0\x7b"),
            Command::SetBytes { letter: b'M', bytes: vec![63, 0, 123] }
        );
        assert_eq!(only(b"CA"), Command::SetBytes { letter: b'C', bytes: vec![b'A'] });
        let period = Command::SetNumbers { letter: b't', numbers: vec![1152, 1] };
        assert_eq!(only(b"t 1152 1\r"), period);
        assert_eq!(only(b"u 0 1\r"), Command::TooManyNumbers);
        assert_eq!(only(b"t\r"), Command::Unknown);
        assert_eq!(only(b"t -1\r"), Command::Unknown);
        assert_eq!(only(b"Z"), Command::Unknown);
    }

    #[test]
    fn an_incomplete_command_waits_and_an_endless_line_does_not() {
        for part in [&b""[..], b"?", b"D", b"M\x01\x02", b"C", b"CO\x01", b"t 1152 1"] {
            assert_eq!(next_command(part), None, "{part:?}");
        }
        let endless = [b'u'; 200];
        assert_eq!(next_command(&endless), Some((Command::TooManyNumbers, LINE_LIMIT)));
    }

    proptest! {
        #[test]
        fn any_bytes_are_cut_into_commands_of_bounded_length(bytes: Vec<u8>) {
            let mut rest = &bytes[..];
            while let Some((_, length)) = next_command(rest) {
                prop_assert!((1..=LINE_LIMIT).contains(&length));
                rest = &rest[length..];
            }
            prop_assert!(rest.len() < LINE_LIMIT);
        }
    }
}
