//! Any cut of any frames gives the same frames; damage gives an error, never a wrong message.
//!
//! How the fuzz works: 1. draw frames with payloads at the least and the most length and between;
//! 2. in half of the rounds flip one bit of the stream, in a quarter close it early; 3. feed it in
//! random pieces; 4. without a fault all frames must come out and the end must be clean; with one,
//! exactly the frames before it and then an error.

use softgrasp_protocol::*;

use crate::raw::{Random, fuzz_plan, raw_frame};
use crate::samples::{Message, conversation};

/// All frames that `pieces` give, and how the stream ended.
fn frames_of<'a>(
    pieces: impl IntoIterator<Item = &'a [u8]>,
    limits: Limits,
) -> (Vec<Frame>, Result<(), FrameError>) {
    let mut buffer = FrameBuffer::new(limits);
    let mut frames = vec![];
    let mut received_max = 0;
    for piece in pieces {
        buffer.feed(piece);
        received_max = received_max.max(buffer.received());
        let most = 4 * received_max + 256 * 1024;
        assert!(buffer.capacity() <= most, "{} bytes for {received_max}", buffer.capacity());
        loop {
            match buffer.next_frame() {
                Ok(Some(frame)) => frames.push(frame),
                Ok(None) => break,
                Err(error) => return (frames, Err(error)),
            }
        }
    }
    (frames, buffer.finish())
}

fn recording() -> (Vec<u8>, Vec<Frame>) {
    let bytes: Vec<u8> = conversation().iter().flat_map(Message::encode).collect();
    let (frames, end) = frames_of([bytes.as_slice()], Limits::default());
    assert_eq!(end, Ok(()));
    assert_eq!(frames.len(), Kind::ALL.len());
    (bytes, frames)
}

#[test]
fn every_cut_of_a_conversation_gives_the_same_frames() {
    let (bytes, frames) = recording();
    for cut in 0..=bytes.len() {
        let (before, after) = bytes.split_at(cut);
        let (cut_frames, end) = frames_of([before, after], Limits::default());
        assert_eq!(end, Ok(()));
        assert_eq!(cut_frames, frames, "cut after {cut} bytes");
    }
}

#[test]
fn one_byte_at_a_time_gives_the_same_frames() {
    let (bytes, frames) = recording();
    assert_eq!(frames_of(bytes.chunks(1), Limits::default()), (frames, Ok(())));
}

#[test]
fn every_early_end_is_clean_at_a_border_and_truncated_elsewhere() {
    let (bytes, frames) = recording();
    let mut borders = vec![0];
    for frame in &frames {
        borders.push(borders.last().unwrap() + HEADER_LEN + frame.payload.len());
    }
    for cut in 0..bytes.len() {
        let (whole, end) = frames_of([&bytes[..cut]], Limits::default());
        let border = borders.partition_point(|border| *border <= cut) - 1;
        assert_eq!(whole, frames[..border]);
        match end {
            Ok(()) => assert_eq!(borders[border], cut),
            Err(FrameError::Truncated { received, .. }) => {
                assert!(received > 0);
                assert_eq!(received, cut - borders[border]);
            }
            Err(other) => panic!("cut after {cut} bytes: {other}"),
        }
    }
}

#[test]
fn every_bit_flip_of_every_kind_is_an_error() {
    for message in conversation() {
        let bytes = message.encode();
        for bit in 0..bytes.len() * 8 {
            let mut damaged = bytes.clone();
            damaged[bit / 8] ^= 1 << (bit % 8);
            let (frames, end) = frames_of([damaged.as_slice()], Limits::default());
            assert!(frames.is_empty(), "bit {bit} of {} passed", message.kind());
            assert!(!matches!(end, Ok(()) | Err(FrameError::Truncated { .. })), "bit {bit}");
        }
    }
}

#[test]
fn random_streams_come_out_whole_or_with_an_error() {
    for seed in fuzz_plan(1998, 400) {
        println!("SEED={seed}");
        let mut random = Random::new(seed);
        let payload_len_max = [0, 16, 5000, 200_000][random.below(4)];
        let frames: Vec<Vec<u8>> = (0..1 + random.below(12))
            .map(|_| {
                let len = match random.below(4) {
                    0 => 0,
                    1 => payload_len_max,
                    _ => random.below(payload_len_max + 1),
                };
                let kind = u16::try_from(random.below(1 << 16)).unwrap();
                let payload = random.bytes(len);
                raw_frame(kind, random.next(), &payload)
            })
            .collect();
        check_stream(&frames, payload_len_max, &mut random);
    }
}

/// One round: the frames, perhaps a fault, random pieces, and what must come of it.
fn check_stream(frames: &[Vec<u8>], payload_len_max: usize, random: &mut Random) {
    let mut bytes = frames.concat();
    let frame_at = |position: usize| {
        let mut end = 0;
        frames.iter().position(|frame| {
            end += frame.len();
            position < end
        })
    };
    let (mut flipped, mut closed) = (None, None);
    if random.chance(2) {
        let bit = random.below(bytes.len() * 8);
        bytes[bit / 8] ^= 1 << (bit % 8);
        flipped = frame_at(bit / 8);
    } else if random.chance(2) {
        let cut = random.below(bytes.len());
        bytes.truncate(cut);
        closed = frame_at(cut);
    }
    let mut pieces = vec![];
    let mut rest = bytes.as_slice();
    let piece_len_max = [1, 7, 100, 70_000][random.below(4)].max(bytes.len() / 5000);
    while !rest.is_empty() {
        let (piece, later) = rest.split_at((1 + random.below(piece_len_max)).min(rest.len()));
        pieces.push(piece);
        rest = later;
    }
    let limits =
        Limits { payload_len_max: u32::try_from(payload_len_max).unwrap(), ..Limits::default() };
    let (out, end) = frames_of(pieces, limits);
    let whole = flipped.or(closed).unwrap_or(frames.len());
    assert_eq!(out.len(), whole);
    for (out, sent) in out.iter().zip(frames) {
        let again = raw_frame(out.header.kind, out.request_id(), &out.payload);
        assert_eq!(&again, sent);
    }
    if flipped.is_some() {
        assert!(!matches!(end, Ok(()) | Err(FrameError::Truncated { .. })), "{end:?}");
    } else if frames[..whole].iter().map(Vec::len).sum::<usize>() == bytes.len() {
        assert_eq!(end, Ok(()));
    } else {
        assert!(matches!(end, Err(FrameError::Truncated { .. })), "{end:?}");
    }
}

#[test]
fn many_pieces_cost_no_more_than_a_few_copies() {
    // 16 MiB in pieces of 16 bytes: a buffer that looked at everything again for each piece would
    // touch 2⁴³ bytes, many minutes' work; this one needs a fraction of a second.
    let frame = raw_frame(4, 1, &vec![0x5a; 16 << 20]);
    let (frames, end) = frames_of(frame.chunks(16), Limits::default());
    assert_eq!((frames.len(), end), (1, Ok(())));
}
