//! Cuts what the client sends to the tracker into commands.

/// A command of the client to the tracker.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Command {
    /// A letter or control character that stands alone.
    Single(u8),
    /// A letter and its fields; an omitted field is `None`.
    Fields { letter: u8, fields: Vec<Field> },
    /// `X` and the text behind it.
    Text(String),
    /// A letter that the tracker does not know as a command.
    Unknown(u8),
    /// The end of a line that a command did not need.
    Nothing,
}

/// One field between commas.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Field {
    /// Nothing stands in the field: the old value stays.
    Omitted,
    /// A finite number.
    Number(f64),
    /// Text that is not a finite number.
    NotNumeric,
}

impl Field {
    /// The number, if the field holds one.
    pub(super) fn number(self) -> Option<f64> {
        match self {
            Self::Number(number) => Some(number),
            Self::Omitted | Self::NotNumeric => None,
        }
    }
}

/// Longest command with fields.
const LINE_LIMIT: usize = 120;

/// The first command of `bytes` and its length, `None` while it is incomplete.
pub(super) fn next_command(bytes: &[u8]) -> Option<(Command, usize)> {
    let &letter = bytes.first()?;
    match letter {
        b'P' | b'C' | b'c' | b'F' | b'f' | b'U' | b'u' | b'S' | b'D' | b'd' | b'W' | b'T'
        | 0x0B | 0x19 | 0x13 | 0x11 => Some((Command::Single(letter), 1)),
        b'\r' | b'\n' | b' ' => Some((Command::Nothing, 1)),
        b'O' | b'H' | b'B' | b'b' | b'G' | b'A' | b'R' | b'r' | b'N' | b'V' | b'Q' | b'I'
        | b'l' | b'e' | b'x' | b'v' | b'X' | b'o' => line(bytes, letter),
        _ => Some((Command::Unknown(letter), 1)),
    }
}

fn line(bytes: &[u8], letter: u8) -> Option<(Command, usize)> {
    let Some(end) = bytes.iter().take(LINE_LIMIT).position(|&byte| byte == b'\r') else {
        return (bytes.len() >= LINE_LIMIT).then_some((Command::Unknown(letter), LINE_LIMIT));
    };
    let text = &bytes[1..end];
    let command = if letter == b'X' {
        let printable = text.iter().filter(|byte| byte.is_ascii_graphic() || **byte == b' ');
        Command::Text(printable.map(|&byte| char::from(byte)).collect())
    } else {
        let fields = match text.trim_ascii() {
            b"" => Vec::new(),
            text => text.split(|&byte| byte == b',').map(field).collect(),
        };
        Command::Fields { letter, fields }
    };
    Some((command, end + 1))
}

fn field(text: &[u8]) -> Field {
    let text = std::str::from_utf8(text).unwrap_or("not text").trim();
    match text.parse::<f64>() {
        _ if text.is_empty() => Field::Omitted,
        Ok(number) if number.is_finite() => Field::Number(number),
        _ => Field::NotNumeric,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn letters_stand_alone_or_wait_for_their_fields() {
        assert_eq!(next_command(b"PP"), Some((Command::Single(b'P'), 1)));
        assert_eq!(next_command(b"O1,2,11"), None);
        let fields = [1.0, 2.0, 11.0, 1.0].map(Field::Number).to_vec();
        let list = Command::Fields { letter: b'O', fields };
        assert_eq!(next_command(b"O1,2,11,1\rC"), Some((list, 10)));
        let fields = vec![Field::Omitted, Field::NotNumeric];
        let filter = Command::Fields { letter: b'x', fields };
        assert_eq!(next_command(b"x,a\r"), Some((filter, 4)));
        let empty = Command::Fields { letter: b'v', fields: Vec::new() };
        assert_eq!(next_command(b"v\r"), Some((empty, 2)));
        assert_eq!(next_command(b"z"), Some((Command::Unknown(b'z'), 1)));
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
