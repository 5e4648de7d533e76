//! Splits lines of JSON, which arrive in pieces of any size, into records of joints and faults.

use super::cut::{LineCutter, Piece};
use super::decode::decode_line;
use super::fault::{JointsFault, JointsFaultKind};
use super::record::JointsRecord;

/// An event of the stream: a record of joints, or a fault.
#[derive(Clone, Debug, PartialEq)]
pub enum JointsEvent {
    /// The joints of one hand at one moment.
    Record(Box<JointsRecord>),
    /// Bytes that are no record.
    Fault(JointsFault),
}

/// Parser of lines of joints (`docs/joints.md`).
///
/// As an iterator it yields every event of the bytes fed so far; `None` means "feed more", and it
/// may yield again afterwards. Memory is bounded whatever arrives. Each line stands for itself, so
/// a bad one costs no other; an empty line is no event.
#[derive(Clone, Debug, Default)]
pub struct JointsParser {
    stream: LineCutter,
    /// Lines of datagrams, apart from the stream: a datagram may come between two parts of a line.
    datagram: LineCutter,
}

impl JointsParser {
    /// A parser without any bytes.
    pub fn new() -> Self {
        Self::default()
    }

    /// Takes bytes from a stream and returns how many it took.
    ///
    /// It takes all of them unless some 16 KiB are waiting: then read the events and feed the rest.
    #[must_use = "bytes beyond the returned number were not taken"]
    pub fn feed(&mut self, bytes: &[u8]) -> usize {
        self.stream.push(bytes)
    }

    /// Feeds all bytes of a stream and hands each event to `on_event`.
    pub fn feed_all(&mut self, bytes: &[u8], on_event: impl FnMut(JointsEvent)) {
        feed_lines(&mut self.stream, bytes, on_event);
    }

    /// Reads one datagram, of one or more lines, and hands each event to `on_event`.
    ///
    /// The end of the datagram ends its last line too. Lines of the stream are not touched.
    pub fn feed_datagram(&mut self, bytes: &[u8], mut on_event: impl FnMut(JointsEvent)) {
        feed_lines(&mut self.datagram, bytes, &mut on_event);
        if self.datagram.is_inside_a_line() {
            feed_lines(&mut self.datagram, b"\n", &mut on_event);
        }
    }
}

impl Iterator for JointsParser {
    type Item = JointsEvent;

    fn next(&mut self) -> Option<JointsEvent> {
        next_event(&mut self.stream)
    }
}

fn feed_lines(lines: &mut LineCutter, mut bytes: &[u8], mut on_event: impl FnMut(JointsEvent)) {
    loop {
        let taken = lines.push(bytes);
        bytes = bytes.get(taken..).unwrap_or_default();
        while let Some(event) = next_event(lines) {
            on_event(event);
        }
        // Less than a line is left waiting, so each further turn takes some.
        if bytes.is_empty() {
            return;
        }
    }
}

fn next_event(lines: &mut LineCutter) -> Option<JointsEvent> {
    loop {
        let (kind, bytes_skipped) = match lines.next_piece()? {
            Piece::Line(line) if line.trim_ascii().is_empty() => continue,
            Piece::Line(line) => match decode_line(line) {
                Ok(record) => return Some(JointsEvent::Record(Box::new(record))),
                Err(kind) => (kind, line.len() + 1),
            },
            Piece::TooLong(dropped) => (JointsFaultKind::TooLong, dropped),
        };
        return Some(JointsEvent::Fault(JointsFault { kind, bytes_skipped }));
    }
}

#[cfg(test)]
#[path = "parser_tests.rs"]
mod tests;
