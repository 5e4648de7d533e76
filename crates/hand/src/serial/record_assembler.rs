//! Puts together what belongs together: records that came in pieces, with the time of their first
//! byte.

use std::collections::VecDeque;
use std::time::Instant;

/// How a device's bytes are cut.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Cut {
    /// Glove: after each NUL.
    AtNul,
    /// Tracker: records of this length that begin with `0`, replies that begin with `2`.
    TrackerRecords {
        /// Bytes of a record, CR LF included.
        length: usize,
    },
}

/// Bytes that are handed on together.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Piece {
    pub(super) bytes: Vec<u8>,
    /// When the first byte of the piece arrived.
    pub(super) arrived: Instant,
    /// Whether the piece looks like a record or a reply.
    pub(super) whole: bool,
}

/// Bytes on their way into pieces. No byte is lost, changed or put elsewhere.
#[derive(Clone, Debug)]
pub(super) struct RecordAssembler {
    cut: Cut,
    waiting: VecDeque<u8>,
    /// How many of the waiting bytes came together, and when.
    marks: VecDeque<(usize, Instant)>,
}

/// Number of bytes without an end of record after which they are handed on as they are.
const LIMIT: usize = 512;
/// Longest reply of the tracker.
const REPLY_LIMIT: usize = 128;

impl RecordAssembler {
    pub(super) fn new(cut: Cut) -> Self {
        Self { cut, waiting: VecDeque::new(), marks: VecDeque::new() }
    }

    /// Takes bytes that arrived together.
    pub(super) fn push(&mut self, bytes: &[u8], arrived: Instant) {
        if !bytes.is_empty() {
            self.waiting.extend(bytes);
            self.marks.push_back((bytes.len(), arrived));
        }
    }

    /// The next piece that is complete.
    pub(super) fn next(&mut self) -> Option<Piece> {
        let waiting = self.waiting.make_contiguous();
        let (length, whole) = match self.cut {
            Cut::AtNul => at_nul(waiting)?,
            Cut::TrackerRecords { length } => tracker(waiting, length)?,
        };
        self.take(length, whole)
    }

    /// The bytes that are left, as one piece.
    pub(super) fn rest(&mut self) -> Option<Piece> {
        self.take(self.waiting.len(), false)
    }

    fn take(&mut self, length: usize, whole: bool) -> Option<Piece> {
        let (_, arrived) = *self.marks.front()?;
        let bytes: Vec<u8> = self.waiting.drain(..length).collect();
        let mut left = length;
        while let Some((count, _)) = self.marks.front_mut() {
            if *count > left {
                *count -= left;
                break;
            }
            left -= *count;
            self.marks.pop_front();
        }
        Some(Piece { bytes, arrived, whole })
    }
}

fn at_nul(waiting: &[u8]) -> Option<(usize, bool)> {
    match waiting.iter().position(|&byte| byte == 0) {
        Some(end) => Some((end + 1, true)),
        None if waiting.len() >= LIMIT => Some((waiting.len(), false)),
        None => None,
    }
}

fn tracker(waiting: &[u8], length: usize) -> Option<(usize, bool)> {
    match *waiting.first()? {
        b'0' => {
            let record = waiting.get(..length)?;
            if record.ends_with(b"\r\n") {
                return Some((length, true));
            }
        }
        b'2' => {
            let end = waiting.windows(2).take(REPLY_LIMIT).position(|pair| pair == b"\r\n");
            if let Some(end) = end {
                return Some((end + 2, true));
            }
            if waiting.len() < REPLY_LIMIT {
                return None;
            }
        }
        _ => {}
    }
    // Up to where something could begin.
    let begins = |byte: &u8| matches!(byte, b'0' | b'2');
    let next = waiting.iter().skip(1).position(begins).map_or(waiting.len(), |at| at + 1);
    Some((next, false))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::time::Duration;

    fn pieces(assembler: &mut RecordAssembler) -> Vec<Piece> {
        std::iter::from_fn(|| assembler.next()).collect()
    }

    #[test]
    fn a_record_has_the_time_of_its_first_byte() {
        let start = Instant::now();
        let at = |ms| start + Duration::from_millis(ms);
        let mut glove = RecordAssembler::new(Cut::AtNul);
        glove.push(b"Gab", at(0));
        assert_eq!(glove.next(), None);
        glove.push(b"c\0Gd", at(1));
        glove.push(b"ef\0", at(2));
        let found = pieces(&mut glove);
        assert_eq!(found.len(), 2);
        assert_eq!((&found[0].bytes[..], found[0].arrived), (&b"Gabc\0"[..], at(0)));
        assert_eq!((&found[1].bytes[..], found[1].arrived), (&b"Gdef\0"[..], at(1)));
        assert!(found.iter().all(|piece| piece.whole));
    }

    #[test]
    fn tracker_records_may_hold_line_ends_and_digits() {
        let now = Instant::now();
        let record = b"01 \r\n0201abcde\r\n";
        let mut tracker = RecordAssembler::new(Cut::TrackerRecords { length: record.len() });
        tracker.push(b"de\r\n", now);
        tracker.push(record, now);
        tracker.push(b"21S3F0\r\n", now);
        tracker.push(record, now);
        let found = pieces(&mut tracker);
        let whole: Vec<&[u8]> = found.iter().filter(|p| p.whole).map(|p| &p.bytes[..]).collect();
        assert_eq!(whole, [&record[..], b"21S3F0\r\n", record]);
        assert_eq!(found[0].bytes, b"de\r\n");
    }

    proptest! {
        #[test]
        fn no_byte_is_lost_or_moved_and_little_waits(
            parts in prop::collection::vec(prop::collection::vec(
                prop_oneof![any::<u8>(), Just(0), Just(b'0'), Just(b'2'), Just(b'\n')], 0..60), 0..40),
            glove in any::<bool>(),
        ) {
            let cut = if glove { Cut::AtNul } else { Cut::TrackerRecords { length: 33 } };
            let mut assembler = RecordAssembler::new(cut);
            let start = Instant::now();
            let mut out = Vec::new();
            let mut last = start;
            for (i, part) in parts.iter().enumerate() {
                assembler.push(part, start + Duration::from_millis(i as u64));
                for piece in pieces(&mut assembler) {
                    prop_assert!(piece.arrived >= last && !piece.bytes.is_empty());
                    last = piece.arrived;
                    out.extend(piece.bytes);
                }
                prop_assert!(assembler.waiting.len() < LIMIT);
                let marked: usize = assembler.marks.iter().map(|(count, _)| count).sum();
                prop_assert_eq!(marked, assembler.waiting.len());
            }
            out.extend(assembler.rest().map(|piece| piece.bytes).unwrap_or_default());
            prop_assert_eq!(out, parts.concat());
        }
    }
}
