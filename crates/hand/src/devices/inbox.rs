//! Bytes that arrived from a device and are not parsed yet, never more than a fixed number, and how a parser
//! is fed with more than it takes at once.

/// Bounded first-in-first-out bytes.
///
/// Invariant: `start <= bytes.len() <= LIMIT`.
#[derive(Clone, Debug, Default)]
pub(super) struct Inbox {
    bytes: Vec<u8>,
    start: usize,
}

impl Inbox {
    /// Most bytes held at once: some hundred records, a second of the fastest serial line.
    pub(super) const LIMIT: usize = 4096;

    /// Takes as many bytes as fit and returns how many those were.
    pub(super) fn push(&mut self, bytes: &[u8]) -> usize {
        self.bytes.drain(..self.start);
        self.start = 0;
        let taken = bytes.len().min(Self::LIMIT - self.bytes.len());
        self.bytes.extend_from_slice(&bytes[..taken]);
        taken
    }

    /// Everything not consumed yet.
    pub(super) fn waiting(&self) -> &[u8] {
        &self.bytes[self.start..]
    }

    /// Forgets the first `count` waiting bytes.
    pub(super) fn consume(&mut self, count: usize) {
        self.start = (self.start + count).min(self.bytes.len());
    }
}

/// Feeds all bytes to a parser and hands each of its events to `on_event`.
///
/// `feed` takes bytes and returns how many it took. Reading every event leaves less than one record
/// or reply waiting, so each further call takes some.
pub(super) fn feed_all<Parser: Iterator>(
    parser: &mut Parser,
    feed: impl Fn(&mut Parser, &[u8]) -> usize,
    mut bytes: &[u8],
    mut on_event: impl FnMut(Parser::Item),
) {
    loop {
        let taken = feed(parser, bytes);
        bytes = bytes.get(taken..).unwrap_or_default();
        parser.by_ref().for_each(&mut on_event);
        if bytes.is_empty() {
            return;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bytes_come_out_in_order_and_never_exceed_the_limit() {
        let mut inbox = Inbox::default();
        assert_eq!(inbox.push(&[7; 3]), 3);
        assert_eq!(inbox.push(&[8; 5000]), Inbox::LIMIT - 3);
        assert_eq!(inbox.push(&[9]), 0);
        inbox.consume(4);
        assert_eq!(inbox.waiting()[0], 8);
        assert_eq!(inbox.push(&[9; 10]), 4);
        assert_eq!(inbox.waiting().len(), Inbox::LIMIT);
        inbox.consume(usize::MAX / 2);
        assert!(inbox.waiting().is_empty());
    }
}
