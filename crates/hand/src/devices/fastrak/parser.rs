//! Splits the tracker's byte stream, which arrives in pieces of any size, into records and replies.

use super::decode::{Head, head};
use super::fault::{FastrakFault, FastrakFaultKind};
use super::flip::{FlipWatch, HemisphereFlip};
use super::record::{FastrakFormat, FastrakRecord};
use crate::devices::inbox::Inbox;
use crate::devices::inbox::feed_all;

/// An event of the stream: a record of the tracker, a flip, a reply, or a fault.
#[derive(Clone, Debug, PartialEq)]
pub enum FastrakEvent {
    /// A record of the tracker.
    Record(FastrakRecord),
    /// The next record, of the same station, is about opposite to the one before it.
    HemisphereFlip(HemisphereFlip),
    /// A status, read-back or error record (starts with `2`), without its CR LF.
    Reply(String),
    /// Bytes that are neither a record nor a reply.
    Fault(FastrakFault),
}

/// Parser of the tracker's byte stream.
///
/// As an iterator it yields every event of the bytes fed so far; `None` means "feed more", and
/// it may yield again afterwards. Memory is bounded whatever arrives.
///
/// Floats may contain `0` and CR LF, so a record counts only if station digit, error byte,
/// length, CR LF and every number are what a tracker sends; else one byte is dropped and the next
/// tried. A fault covers a whole run of dropped bytes.
///
/// Source: thesis section 2.1.
#[derive(Clone, Debug)]
pub struct FastrakParser {
    format: FastrakFormat,
    inbox: Inbox,
    flips: FlipWatch,
    lost: Option<FastrakFault>,
    pending: Option<FastrakRecord>,
}

/// A run of skipped bytes is reported at least this often.
const REPORT_EVERY: usize = 1024;

impl FastrakParser {
    /// Parser for one tracker, empty.
    pub fn new(format: FastrakFormat) -> Self {
        Self {
            format,
            inbox: Inbox::default(),
            flips: FlipWatch::default(),
            lost: None,
            pending: None,
        }
    }

    /// Takes bytes from the line and returns how many it took.
    ///
    /// It takes all of them unless some 4 KiB are waiting: then read the events and feed the rest.
    #[must_use = "bytes beyond the returned number were not taken"]
    pub fn feed(&mut self, bytes: &[u8]) -> usize {
        self.inbox.push(bytes)
    }

    /// Feeds all bytes and hands each event to `on_event`.
    pub fn feed_all(&mut self, bytes: &[u8], on_event: impl FnMut(FastrakEvent)) {
        feed_all(self, Self::feed, bytes, on_event);
    }

    /// Drops one byte; a fault when the run is long enough to be reported.
    fn skip(&mut self, kind: FastrakFaultKind) -> Option<FastrakEvent> {
        self.inbox.consume(1);
        let lost = self.lost.get_or_insert(FastrakFault { kind, bytes_skipped: 0 });
        lost.bytes_skipped += 1;
        if lost.bytes_skipped < REPORT_EVERY {
            return None;
        }
        self.lost.take().map(FastrakEvent::Fault)
    }
}

impl Iterator for FastrakParser {
    type Item = FastrakEvent;

    fn next(&mut self) -> Option<FastrakEvent> {
        if let Some(record) = self.pending.take() {
            return Some(FastrakEvent::Record(record));
        }
        loop {
            let found = head(self.inbox.waiting(), self.format);
            if matches!(found, Head::Record(_) | Head::Reply(_))
                && let Some(fault) = self.lost.take()
            {
                return Some(FastrakEvent::Fault(fault));
            }
            match found {
                Head::NeedMore => return None,
                Head::Skip(kind) => {
                    if let Some(event) = self.skip(kind) {
                        return Some(event);
                    }
                }
                Head::Reply(length) => {
                    let text = &self.inbox.waiting()[..length];
                    let text = String::from_utf8_lossy(text).trim_end().to_owned();
                    self.inbox.consume(length);
                    return Some(FastrakEvent::Reply(text));
                }
                Head::Record(record) => {
                    self.inbox.consume(self.format.record_length());
                    let position = record.position_in_transmitter();
                    // A record with a failed self-test says nothing about the hemisphere.
                    let flip = match record.error {
                        None => self.flips.observe(record.station, position),
                        Some(_) => None,
                    };
                    let Some(flip) = flip else { return Some(FastrakEvent::Record(record)) };
                    self.pending = Some(record);
                    return Some(FastrakEvent::HemisphereFlip(flip));
                }
            }
        }
    }
}

#[cfg(test)]
#[path = "parser_tests.rs"]
mod tests;
