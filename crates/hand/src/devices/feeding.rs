//! Feeding a device's parser with more bytes than it takes at once.

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
