//! Frames written from the document alone, and a small random source with a printed seed.

use softgrasp_protocol::{Frame, FrameBuffer, Limits};

/// A sound frame around any payload, written without the crate's own encoder.
pub fn raw_frame(kind: u16, request_id: u64, payload: &[u8]) -> Vec<u8> {
    let mut bytes = b"SGRP".to_vec();
    bytes.extend(4_u16.to_le_bytes());
    bytes.extend(kind.to_le_bytes());
    bytes.extend(0_u32.to_le_bytes());
    bytes.extend(u32::try_from(payload.len()).unwrap().to_le_bytes());
    bytes.extend(request_id.to_le_bytes());
    let header_crc = crc32c::crc32c(&bytes);
    bytes.extend(header_crc.to_le_bytes());
    let frame_crc = crc32c::crc32c(&[&bytes, payload].concat());
    bytes.extend(frame_crc.to_le_bytes());
    bytes.extend(payload);
    bytes
}

/// A payload that is only a part with these fields.
pub fn part_of(fields: &[u8]) -> Vec<u8> {
    let mut payload = (fields.len() as u64).to_le_bytes().to_vec();
    payload.extend(fields);
    payload.resize(payload.len().next_multiple_of(8), 0);
    payload
}

/// The one frame in `bytes`.
pub fn only_frame(bytes: &[u8]) -> Frame {
    let mut buffer = FrameBuffer::new(Limits::default());
    buffer.feed(bytes);
    let frame = buffer.next_frame().unwrap().expect("a whole frame");
    assert_eq!(buffer.next_frame(), Ok(None));
    buffer.finish().expect("nothing behind it");
    frame
}

/// Random numbers (splitmix64), the same for the same seed on every machine.
pub struct Random(u64);

impl Random {
    pub fn new(seed: u64) -> Self {
        Self(seed)
    }

    pub fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// Random number below `end`, which must not be 0.
    pub fn below(&mut self, end: usize) -> usize {
        usize::try_from(self.next() % end as u64).unwrap()
    }

    pub fn chance(&mut self, one_in: usize) -> bool {
        self.below(one_in) == 0
    }

    pub fn bytes(&mut self, len: usize) -> Vec<u8> {
        (0..len).map(|_| self.next().to_le_bytes()[0]).collect()
    }
}

/// Seeds of the rounds, from `SEED` and `FUZZ_ROUNDS` of the environment or from the arguments.
pub fn fuzz_plan(seed: u64, rounds: u64) -> std::ops::Range<u64> {
    let read = |name: &str, default: u64| match std::env::var(name) {
        Ok(text) => text.parse().expect("a whole number"),
        Err(_) => default,
    };
    let seed = read("SEED", seed);
    seed..seed + read("FUZZ_ROUNDS", rounds)
}
