//! Splits the glove's byte stream, which arrives in pieces of any size, into records and faults.

use super::record::{
    GloveEncoding, GloveRecord, RecordError, RecordOptions, decode_frame, decode_line,
};
use super::sensor::SensorCount;
use crate::devices::inbox::Inbox;
use crate::devices::inbox::feed_all;

/// Error that the interface unit reports.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum GloveError {
    /// The unit replied `e?`: it does not know the command.
    #[error("unknown command")]
    UnknownCommand,
    /// The unit replied `en`: the command has too many numbers.
    #[error("too many numbers in a command")]
    TooManyNumbers,
    /// The unit replied `ey`: the synchronisation rate is too fast.
    #[error("synchronisation rate too fast")]
    SyncTooFast,
    /// The unit replied `eg`: no glove is plugged in.
    #[error("glove not plugged in")]
    NotPluggedIn,
    /// The unit replied `es`: the sampling rate is too fast.
    #[error("sampling rate too fast")]
    SamplingTooFast,
}

impl GloveError {
    fn from_text(text: &[u8]) -> Option<Self> {
        match text {
            b"e?" => Some(Self::UnknownCommand),
            b"en" => Some(Self::TooManyNumbers),
            b"ey" => Some(Self::SyncTooFast),
            b"eg" => Some(Self::NotPluggedIn),
            b"es" => Some(Self::SamplingTooFast),
            _ => None,
        }
    }
}

/// Why bytes did not become a record.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum GloveFaultKind {
    /// The unit reports an error.
    #[error("the glove reports: {0}")]
    Device(GloveError),
    /// A NUL came too early or too late: lost or inserted bytes, or a zero among the sensors.
    #[error("{got} bytes before the NUL, a record has {expected}")]
    WrongLength {
        /// Number of bytes before the NUL.
        got: usize,
        /// Number of bytes that a record has there.
        expected: usize,
    },
    /// No NUL where every possible record has ended: wrong speed, or not a glove.
    #[error("no NUL within the length of a record")]
    NoTerminator,
    /// The right length, but the first byte is neither `G` nor `S`.
    #[error("a record starts with byte {byte:#04x}")]
    UnknownStart {
        /// First byte of the piece.
        byte: u8,
    },
    /// A line whose numbers are too few, too many, or none that a sensor sends.
    #[error("a line of {got} numbers, {expected} from 1 to 255 are a record")]
    WrongNumbers {
        /// Number of fields in the line.
        got: usize,
        /// Number of sensors of the glove.
        expected: usize,
    },
    /// The status byte lacks its always-set bit.
    #[error("status byte {byte:#04x} lacks bit 7")]
    BadStatus {
        /// Status byte that was found.
        byte: u8,
    },
}

/// Bytes that were thrown away, and why.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{kind} ({bytes_skipped} bytes skipped)")]
pub struct GloveFault {
    /// Why the bytes did not become a record.
    pub kind: GloveFaultKind,
    /// Number of bytes thrown away, NUL included; 0 when a good record came with the complaint.
    pub bytes_skipped: usize,
}

/// An event of the stream: a record of the glove, or a fault.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum GloveEvent {
    /// A record of the glove.
    Record(GloveRecord),
    /// Bytes that are no record, or a complaint of the unit.
    Fault(GloveFault),
}

/// Parser of the glove's byte stream.
///
/// As an iterator it yields every event of the bytes fed so far; `None` means "feed more", and
/// it may yield again afterwards. Memory is bounded whatever arrives.
///
/// Sensor values are never zero and every record ends with NUL, so the stream is cut at NULs and
/// a piece is a record only if it has exactly the right length: garbage before a record costs
/// that record, never the next one.
///
/// Source: thesis section 2.2.1.
#[derive(Clone, Debug)]
pub struct GloveParser {
    count: SensorCount,
    options: RecordOptions,
    encoding: GloveEncoding,
    inbox: Inbox,
    /// Set while inside a piece that is already longer than a record: bytes of it dropped since the last
    /// fault.
    overlong: Option<usize>,
    pending: Option<GloveEvent>,
}

/// Bytes of a piece without NUL after which the next fault is reported.
const REPORT_EVERY: usize = 1024;

impl GloveParser {
    /// Parser for one glove, empty.
    pub fn new(count: SensorCount, options: RecordOptions) -> Self {
        let inbox = Inbox::default();
        let encoding = GloveEncoding::Binary;
        Self { count, options, encoding, inbox, overlong: None, pending: None }
    }

    /// Parser of records that are lines of decimal numbers, empty.
    pub fn of_lines(count: SensorCount) -> Self {
        let plain = Self::new(count, RecordOptions::default());
        Self { encoding: GloveEncoding::Ascii, ..plain }
    }

    /// Takes bytes from the line and returns how many it took.
    ///
    /// It takes all of them unless some 4 KiB are waiting: then read the events and feed the rest.
    #[must_use = "bytes beyond the returned number were not taken"]
    pub fn feed(&mut self, bytes: &[u8]) -> usize {
        self.inbox.push(bytes)
    }

    /// Feeds all bytes and hands each event to `on_event`.
    pub fn feed_all(&mut self, bytes: &[u8], on_event: impl FnMut(GloveEvent)) {
        feed_all(self, Self::feed, bytes, on_event);
    }

    /// Longest possible piece before a NUL: a record with an error text.
    fn longest(&self) -> usize {
        match self.encoding {
            GloveEncoding::Binary => self.options.frame_length(self.count) + 2,
            GloveEncoding::Ascii => line_length_max(self.count),
        }
    }

    /// Drops up to `available` bytes of an overlong piece; `ends` if the last of them is its NUL.
    fn drop_overlong(&mut self, available: usize, ends: bool) -> Option<GloveEvent> {
        let dropped = self.overlong.unwrap_or(0);
        let take = available.min(REPORT_EVERY - dropped);
        self.inbox.consume(take);
        let dropped = dropped + take;
        let at_end = ends && take == available;
        let report = at_end || dropped == REPORT_EVERY;
        self.overlong = match (at_end, report) {
            (true, _) => None,
            (false, true) => Some(0),
            (false, false) => Some(dropped),
        };
        report.then_some(GloveEvent::Fault(GloveFault {
            kind: GloveFaultKind::NoTerminator,
            bytes_skipped: dropped,
        }))
    }
}

impl Iterator for GloveParser {
    type Item = GloveEvent;

    fn next(&mut self) -> Option<GloveEvent> {
        if let Some(event) = self.pending.take() {
            return Some(event);
        }
        let waiting = self.inbox.waiting();
        let Some(end) = waiting.iter().position(|&b| b == 0) else {
            let available = waiting.len();
            if available > self.longest() || (self.overlong.is_some() && available > 0) {
                return self.drop_overlong(available, false);
            }
            return None;
        };
        if self.overlong.is_some() || end > self.longest() {
            return self.drop_overlong(end + 1, true);
        }
        let frame = &waiting[..end];
        let (event, pending) = match self.encoding {
            GloveEncoding::Binary => read_frame(frame, self.count, self.options),
            GloveEncoding::Ascii => read_line(frame, self.count),
        };
        self.inbox.consume(end + 1);
        self.pending = pending;
        Some(event)
    }
}

/// The event that the bytes between two NULs mean, and a second event where they hold one.
fn read_frame(
    frame: &[u8],
    count: SensorCount,
    options: RecordOptions,
) -> (GloveEvent, Option<GloveEvent>) {
    let expected = options.frame_length(count);
    let bytes_skipped = frame.len() + 1;
    let fault = |kind| (GloveEvent::Fault(GloveFault { kind, bytes_skipped }), None);
    let (body, text) = frame.split_at(frame.len().saturating_sub(2));
    // An error text stands alone, after the echoed letter, or after a whole record.
    let complaint = match body.len() {
        0 | 1 => GloveError::from_text(text),
        length if length == expected => GloveError::from_text(text),
        _ => None,
    };
    let record_bytes = match complaint {
        Some(GloveError::SamplingTooFast) if body.len() == expected => body,
        Some(error) => return fault(GloveFaultKind::Device(error)),
        None => frame,
    };
    if record_bytes.len() != expected {
        return fault(GloveFaultKind::WrongLength { got: frame.len(), expected });
    }
    match decode_frame(record_bytes, count, options) {
        Ok(record) => {
            // Only the rate could not be kept: the values themselves are good.
            let late = complaint.map(|error| {
                let kind = GloveFaultKind::Device(error);
                GloveEvent::Fault(GloveFault { kind, bytes_skipped: 0 })
            });
            (GloveEvent::Record(record), late)
        }
        Err(RecordError::Letter(byte)) => fault(GloveFaultKind::UnknownStart { byte }),
        Err(RecordError::Status(byte)) => fault(GloveFaultKind::BadStatus { byte }),
        Err(RecordError::Sensors) => {
            fault(GloveFaultKind::WrongLength { got: frame.len(), expected })
        }
    }
}

/// Longest line before its NUL: letter, numbers of three digits, error text, CR LF.
fn line_length_max(count: SensorCount) -> usize {
    1 + 4 * count.number() + 2 + 2
}

/// The event that a line of decimal numbers means, and a second event where it holds one.
fn read_line(line: &[u8], count: SensorCount) -> (GloveEvent, Option<GloveEvent>) {
    let bytes_skipped = line.len() + 1;
    let fault = |kind, bytes_skipped| GloveEvent::Fault(GloveFault { kind, bytes_skipped });
    let plain = line.trim_ascii_end();
    let (body, text) = plain.split_at(plain.len().saturating_sub(2));
    let complaint = GloveError::from_text(text);
    let values = match complaint {
        Some(GloveError::SamplingTooFast) if body.len() > 1 => body,
        Some(error) => return (fault(GloveFaultKind::Device(error), bytes_skipped), None),
        None => plain,
    };
    match decode_line(values, count) {
        Ok(record) => {
            let late = complaint.map(|error| fault(GloveFaultKind::Device(error), 0));
            (GloveEvent::Record(record), late)
        }
        Err(RecordError::Letter(byte)) => {
            (fault(GloveFaultKind::UnknownStart { byte }, bytes_skipped), None)
        }
        Err(_) => {
            let got = values.split(|&byte| byte == b' ').count().saturating_sub(1);
            let kind = GloveFaultKind::WrongNumbers { got, expected: count.number() };
            (fault(kind, bytes_skipped), None)
        }
    }
}

#[cfg(test)]
#[path = "parser_tests.rs"]
mod tests;
