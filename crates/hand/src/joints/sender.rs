//! One sender over TCP: its bytes, handed on as whole lines.

use super::cut::LINE_MAX;

/// What has come from one connection and is not handed on yet: the beginning of a line.
///
/// Invariant: at most [`LINE_MAX`] bytes, without any LF.
#[derive(Clone, Debug, Default)]
pub(super) struct LineBeginning {
    bytes: Vec<u8>,
    /// Inside a line that was too long and has been handed on as far as it was held.
    is_skipping: bool,
}

impl LineBeginning {
    /// Takes bytes and returns all lines that they end, each with its LF.
    ///
    /// Lines of several senders are mixed as wholes. A line that is too long is handed on once,
    /// with more bytes than a line may have, and its rest is dropped.
    pub(super) fn take(&mut self, mut bytes: &[u8]) -> Vec<u8> {
        let mut lines = Vec::new();
        if self.is_skipping {
            let Some(end) = bytes.iter().position(|&b| b == b'\n') else { return lines };
            bytes = &bytes[end + 1..];
            self.is_skipping = false;
        }
        match bytes.iter().rposition(|&b| b == b'\n') {
            Some(end) => {
                lines.append(&mut self.bytes);
                lines.extend_from_slice(&bytes[..=end]);
                self.bytes.extend_from_slice(&bytes[end + 1..]);
            }
            None => self.bytes.extend_from_slice(bytes),
        }
        if self.bytes.len() > LINE_MAX {
            lines.append(&mut self.bytes);
            lines.push(b'\n');
            self.is_skipping = true;
        }
        lines
    }

    /// The last line of a connection that has ended, with the LF that it lacks.
    pub(super) fn end(mut self) -> Vec<u8> {
        if !self.bytes.is_empty() {
            self.bytes.push(b'\n');
        }
        self.bytes
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn lines_within_the_limit_leave_whole_and_unchanged(
            lines in prop::collection::vec("[a-c]{0,50}", 0..12),
            sizes in prop::collection::vec(1usize..60, 1..20),
        ) {
            let text: String = lines.iter().map(|line| format!("{line}\n")).collect();
            let (mut sender, mut got, mut rest) = (LineBeginning::default(), Vec::new(), &text[..]);
            for size in sizes.into_iter().cycle() {
                if rest.is_empty() {
                    break;
                }
                let (piece, later) = rest.split_at(size.min(rest.len()));
                let lines = sender.take(piece.as_bytes());
                prop_assert!(lines.is_empty() || lines.ends_with(b"\n"));
                got.extend(lines);
                rest = later;
            }
            got.extend(sender.end());
            prop_assert_eq!(got, text.into_bytes());
        }
    }

    #[test]
    fn a_line_that_is_too_long_is_handed_on_once() {
        let mut sender = LineBeginning::default();
        let mut handed_on = Vec::new();
        for _ in 0..100 {
            handed_on.extend(sender.take(&[b'x'; 1000]));
            assert!(sender.bytes.len() <= LINE_MAX);
        }
        assert!((LINE_MAX + 2..LINE_MAX + 1002).contains(&handed_on.len()));
        assert_eq!(sender.take(b"yy\nz"), b"");
        assert_eq!(sender.take(b"zz\n"), b"zzz\n");
        assert_eq!(sender.end(), b"");
    }

    #[test]
    fn the_last_line_needs_no_end() {
        let mut sender = LineBeginning::default();
        assert_eq!(sender.take(b"a\nb"), b"a\n");
        assert_eq!(sender.end(), b"b\n");
    }
}
