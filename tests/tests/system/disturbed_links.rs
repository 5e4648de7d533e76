//! Connections that split, delay or cut the bytes: same answers, or a clean end.

use std::time::Duration;

use softgrasp_protocol::{FrameBuffer, HEADER_LEN, Limits, Reply, Request};
use softgrasp_tests::conversation::Conversation;
use softgrasp_tests::faulty_proxy::{Faults, FaultyProxy, Pieces, Recorded, Way};
use softgrasp_tests::heard::Heard;
use softgrasp_tests::random::Random;
use softgrasp_tests::watchdog::within;

use crate::start::server;

const LIMIT: Duration = Duration::from_secs(120);

/// Conversation, its undisturbed replies, and its bytes.
struct Reference {
    conversation: Conversation,
    heard: Vec<Heard>,
    bytes: Recorded,
}

fn reference(proxy: &FaultyProxy) -> Reference {
    let conversation = Conversation::small();
    proxy.set(Faults::default());
    let heard = conversation.hold(proxy.address()).all();
    assert_eq!(heard.len(), conversation.reply_count());
    assert!(!heard.iter().any(|h| matches!(h, Heard::Rejected(..))), "{heard:?}");
    Reference { conversation, heard, bytes: proxy.recorded() }
}

/// Offsets of the ends of the frames in a stream.
fn frame_ends(stream: &[u8]) -> Vec<u64> {
    let mut ends = Vec::new();
    let mut at = 0;
    while at < stream.len() {
        let len = u32::from_le_bytes(stream[at + 12..at + 16].try_into().unwrap());
        at += HEADER_LEN + len as usize;
        ends.push(at as u64);
    }
    assert_eq!(at, stream.len(), "the conversation ends between two frames");
    ends
}

/// Pieces of a stream in which every frame is cut at `offset`, if it is long enough.
fn cut_in_each_frame(ends: &[u64], offset: u64) -> Pieces {
    let starts = std::iter::once(0).chain(ends.iter().copied());
    let cuts = starts.zip(ends).map(|(start, &end)| (start + offset, end));
    Pieces::CutAt(cuts.filter(|&(cut, end)| cut < end).map(|(cut, _)| cut).collect())
}

#[test]
fn cut_at_every_byte_of_every_frame_changes_no_bit() {
    within(LIMIT, "a conversation cut in pieces", || {
        let server = server(1);
        let proxy = FaultyProxy::start(server.address());
        let reference = reference(&proxy);
        let (asked, told) =
            (frame_ends(&reference.bytes.to_server), frame_ends(&reference.bytes.to_client));
        let longest = |ends: &[u64]| {
            let starts = std::iter::once(0).chain(ends.iter().copied());
            starts.zip(ends).map(|(start, end)| end - start).max().unwrap()
        };
        for offset in 1..longest(&asked).max(longest(&told)) {
            let way =
                |ends: &[u64]| Way { pieces: cut_in_each_frame(ends, offset), ..Way::default() };
            proxy.set(Faults { to_server: way(&asked), to_client: way(&told) });
            let heard = reference.conversation.hold(proxy.address()).all();
            assert_eq!(heard, reference.heard, "frames cut at byte {offset}");
        }
    });
}

#[test]
fn random_pieces_single_bytes_and_delays_change_no_bit() {
    within(LIMIT, "a conversation in small pieces", || {
        let mut random = Random::from_environment("random pieces");
        let server = server(1);
        let proxy = FaultyProxy::start(server.address());
        let reference = reference(&proxy);
        let way = |pieces: &Pieces, delay| Way { pieces: pieces.clone(), delay, ..Way::default() };
        let hold = |pieces: Pieces, delay: Option<Duration>| {
            proxy.set(Faults { to_server: way(&pieces, delay), to_client: way(&pieces, delay) });
            let heard = reference.conversation.hold(proxy.address()).all();
            assert_eq!(heard, reference.heard, "{pieces:?}, {delay:?}");
        };
        for _ in 0..60 {
            hold(Pieces::Random(random.number()), None);
        }
        for _ in 0..5 {
            hold(Pieces::Random(random.number()), Some(Duration::from_micros(200)));
        }
        for _ in 0..5 {
            hold(Pieces::OneByte, None);
        }
        hold(Pieces::OneByte, Some(Duration::from_micros(1)));
    });
}

#[test]
fn connection_closed_after_any_byte_of_the_requests_ends_cleanly_and_the_server_goes_on() {
    within(LIMIT, "a conversation whose requests are cut", || {
        let server = server(1);
        let proxy = FaultyProxy::start(server.address());
        let reference = reference(&proxy);
        let ends = frame_ends(&reference.bytes.to_server);
        for close_after in 0..*ends.last().unwrap() {
            let way = Way { close_after: Some(close_after), ..Way::default() };
            proxy.set(Faults { to_server: way, ..Faults::default() });
            let outcome = reference.conversation.hold(proxy.address());
            let count = outcome.heard.len();
            assert!(outcome.ended_cleanly(), "closed after {close_after}: {:?}", outcome.error);
            assert!(outcome.error.is_some(), "closed after {close_after}");
            assert_eq!(outcome.heard, reference.heard[..count], "closed after {close_after}");
            // A request that was just complete may still be answered before the close.
            let surely = ends.iter().filter(|&&end| end < close_after).count();
            let at_most = ends.iter().filter(|&&end| end <= close_after).count();
            assert!((surely..=at_most).contains(&count), "closed after {close_after}: {count}");
        }
        let heard = reference.conversation.hold(server.address()).all();
        assert_eq!(heard, reference.heard, "the server still answers the same");
    });
}

#[test]
fn connection_closed_after_any_byte_of_the_replies_ends_cleanly_and_the_server_goes_on() {
    within(LIMIT, "a conversation whose replies are cut", || {
        let server = server(1);
        let proxy = FaultyProxy::start(server.address());
        let reference = reference(&proxy);
        // Times and memory have fields of fixed width, so the offsets hold for every run.
        let ends = frame_ends(&reference.bytes.to_client);
        for close_after in 0..*ends.last().unwrap() {
            let way = Way { close_after: Some(close_after), ..Way::default() };
            proxy.set(Faults { to_client: way, ..Faults::default() });
            let outcome = reference.conversation.hold(proxy.address());
            assert!(outcome.ended_cleanly(), "closed after {close_after}: {:?}", outcome.error);
            assert!(outcome.error.is_some(), "closed after {close_after}");
            let whole = ends.iter().filter(|&&end| end <= close_after).count();
            assert_eq!(outcome.heard, reference.heard[..whole], "closed after {close_after}");
        }
        let heard = reference.conversation.hold(server.address()).all();
        assert_eq!(heard, reference.heard, "the server still answers the same");
    });
}

#[test]
fn recorded_conversation_decodes_the_same_from_memory_cut_anywhere() {
    let server = server(1);
    let proxy = FaultyProxy::start(server.address());
    let reference = reference(&proxy);
    let mut random = Random::from_environment("recorded conversation");
    let Recorded { to_server, to_client } = &reference.bytes;
    let requests = |cuts: &[usize]| -> Vec<Request> {
        let decode = |frame| Request::decode(&frame, &Limits::default()).unwrap();
        frames(to_server, cuts).into_iter().map(decode).collect()
    };
    let replies = |cuts: &[usize]| -> Vec<Reply> {
        let decode = |frame| Reply::decode(&frame, &Limits::default()).unwrap();
        frames(to_client, cuts).into_iter().map(decode).collect()
    };
    assert_eq!(requests(&[])[1..], *reference.conversation.requests());
    let heard: Vec<Heard> = replies(&[]).iter().map(Heard::of).collect();
    assert_eq!(heard, reference.heard);
    let (all_requests, all_replies) = (requests(&[]), replies(&[]));
    for cut in 1..to_server.len() {
        let second = cut + random.below(to_server.len() - cut);
        assert_eq!(requests(&[cut, second]), all_requests, "cut at {cut} and {second}");
    }
    for cut in 1..to_client.len() {
        let second = cut + random.below(to_client.len() - cut);
        assert_eq!(replies(&[cut, second]), all_replies, "cut at {cut} and {second}");
    }
}

/// Frames of a stream that comes in pieces, with an attempt to read after every piece.
fn frames(stream: &[u8], cuts: &[usize]) -> Vec<softgrasp_protocol::Frame> {
    let mut buffer = FrameBuffer::new(Limits::default());
    let mut taken = Vec::new();
    let mut start = 0;
    for &end in cuts.iter().chain([&stream.len()]) {
        buffer.feed(&stream[start..end]);
        while let Some(frame) = buffer.next_frame().unwrap() {
            taken.push(frame);
        }
        start = end;
    }
    buffer.finish().unwrap();
    taken
}

#[test]
fn damaged_byte_on_the_way_is_seen_and_never_answered_as_something_else() {
    within(LIMIT, "a conversation with a damaged byte", || {
        let server = server(1);
        let proxy = FaultyProxy::start(server.address());
        let reference = reference(&proxy);
        let mut random = Random::from_environment("damaged byte");
        for round in 0..200 {
            let on_requests = round % 2 == 0;
            let Recorded { to_server, to_client } = &reference.bytes;
            let stream = if on_requests { to_server } else { to_client };
            let at = random.below(stream.len()) as u64;
            let way = Way { flip_at: Some(at), ..Way::default() };
            proxy.set(match on_requests {
                true => Faults { to_server: way, ..Faults::default() },
                false => Faults { to_client: way, ..Faults::default() },
            });
            let outcome = reference.conversation.hold(proxy.address());
            let whole = frame_ends(stream).iter().filter(|&&end| end <= at).count();
            // The server may tell what it did not like before it closes.
            let heard: Vec<Heard> =
                outcome.heard.into_iter().filter(|h| !matches!(h, Heard::Rejected(..))).collect();
            assert_eq!(heard, reference.heard[..whole], "byte {at} damaged");
        }
        let heard = reference.conversation.hold(server.address()).all();
        assert_eq!(heard, reference.heard, "the server still answers the same");
    });
}
