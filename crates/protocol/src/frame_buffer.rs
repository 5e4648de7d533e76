//! Collects bytes that come in any pieces into frames.

use bytes::{Buf, Bytes, BytesMut};

use crate::header::check_magic;
use crate::{FrameError, HEADER_LEN, Header, Kind, Limits};

/// One whole, undamaged frame.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Frame {
    /// Decoded header of the frame.
    pub header: Header,
    /// The bytes after the header; shared, so passing a frame on copies nothing.
    pub payload: Bytes,
}

impl Frame {
    /// Kind of message, if this version knows it.
    pub fn kind(&self) -> Option<Kind> {
        Kind::from_number(self.header.kind)
    }

    /// Request id of the header.
    pub fn request_id(&self) -> u64 {
        self.header.request_id
    }
}

/// Received bytes that are not frames yet.
///
/// Put bytes in with [`feed`](Self::feed), or read straight into [`spare_mut`](Self::spare_mut) and
/// say with [`advance`](Self::advance) how many came; then take frames out with
/// [`next_frame`](Self::next_frame) until it says `Ok(None)`.
///
/// Invariant: `0 ≤ summed ≤ received ≤ storage.len() ≤ capacity ≤ 4 · received_max + 256 KiB`,
/// where `received_max` is the most bytes held at once: a length that is only announced takes no
/// memory. Every byte is copied and checksummed a bounded number of times, however it was cut.
#[derive(Debug)]
pub struct FrameBuffer {
    limits: Limits,
    /// Initialised bytes; the first `received` came from the peer, the rest is free.
    storage: BytesMut,
    received: usize,
    /// Header of the frame at the front and the checksum over its first `summed` bytes.
    front: Option<Front>,
    /// Bytes still to come of a frame that is passed over.
    passed_over: usize,
    /// After an error the border of the next frame is unknown, so the error stays.
    failed: Option<FrameError>,
}

#[derive(Clone, Copy, Debug)]
struct Front {
    header: Header,
    summed: usize,
    crc: u32,
}

impl FrameBuffer {
    /// Empty buffer, which takes memory only when bytes come.
    pub fn new(limits: Limits) -> Self {
        Self {
            limits,
            storage: BytesMut::new(),
            received: 0,
            front: None,
            passed_over: 0,
            failed: None,
        }
    }

    /// Sets the limits, which hold from the next header on.
    pub fn set_limits(&mut self, limits: Limits) {
        self.limits = limits;
    }

    /// Appends bytes that are in memory already.
    pub fn feed(&mut self, mut bytes: &[u8]) {
        while !bytes.is_empty() {
            let spare = self.spare_mut();
            let taken = spare.len().min(bytes.len());
            let (now, later) = bytes.split_at(taken);
            spare[..taken].copy_from_slice(now);
            self.advance(taken);
            bytes = later;
        }
    }

    /// Room to read into, never empty; between 4 KiB and the order of what has come so far.
    pub fn spare_mut(&mut self) -> &mut [u8] {
        self.storage.resize(self.len_wanted(), 0);
        &mut self.storage[self.received..]
    }

    /// Bytes of memory that the next [`spare_mut`](Self::spare_mut) brings the buffer to, so that
    /// whoever counts memory can do so before it is taken.
    pub fn len_wanted(&self) -> usize {
        let len = self.storage.len();
        if len - self.received >= SPARE_LEN_MIN {
            return len;
        }
        let missing = match self.front {
            Some(front) => front.header.frame_len().saturating_sub(self.received),
            None => 0,
        };
        // At most doubling: the peer has to send a byte for each byte of room it gets.
        self.received + missing.clamp(STEP_LEN_MIN, self.received.max(STEP_LEN_MIN))
    }

    /// Says that the first `count` bytes of [`spare_mut`](Self::spare_mut) have been filled.
    ///
    /// # Panics
    /// If `count` is more than the room there was: the reader is broken, not the peer.
    pub fn advance(&mut self, count: usize) {
        let room = self.storage.len() - self.received;
        assert!(count <= room, "{count} bytes came, but there was room for {room}");
        // While a frame is passed over nothing else is here.
        let dropped = self.passed_over.min(count);
        if dropped > 0 {
            self.passed_over -= dropped;
            self.storage.copy_within(dropped..count, 0);
        }
        self.received += count - dropped;
    }

    /// Header of the frame at the front, if the header is complete and the frame is not.
    pub fn header(&self) -> Option<Header> {
        self.front.map(|front| front.header)
    }

    /// Gives up the frame whose header is at the front: its memory is freed at once, and its bytes that
    /// are still to come are dropped. The frame after it is read as usual.
    pub fn pass_over(&mut self) {
        let Some(front) = self.front.take() else { return };
        let frame_len = front.header.frame_len();
        let there = frame_len.min(self.received);
        let rest = self.storage.get(there..self.received).unwrap_or_default();
        self.storage = BytesMut::from(rest);
        self.received -= there;
        self.passed_over = frame_len - there;
    }

    /// Next frame; `Ok(None)` means "not yet".
    ///
    /// # Errors
    /// [`FrameError`] as soon as the bytes that are there cannot become a frame; from then on
    /// always the same one.
    pub fn next_frame(&mut self) -> Result<Option<Frame>, FrameError> {
        if let Some(error) = &self.failed {
            return Err(error.clone());
        }
        let result = self.take_front();
        if let Err(error) = &result {
            self.failed = Some(error.clone());
            // The memory of a bad peer is not kept until its session has been cleaned up.
            self.storage = BytesMut::new();
            self.received = 0;
        }
        result
    }

    /// Judges the end of the stream, once [`next_frame`](Self::next_frame) has said `Ok(None)`.
    ///
    /// # Errors
    /// [`FrameError::Truncated`] if the stream ends inside a frame, or the error that was found before.
    pub fn finish(&self) -> Result<(), FrameError> {
        if let Some(error) = &self.failed {
            return Err(error.clone());
        }
        if self.is_at_border() {
            return Ok(());
        }
        let frame_len = self.front.map(|front| front.header.frame_len());
        Err(FrameError::Truncated { received: self.received, frame_len })
    }

    /// Number of bytes that have come of frames not taken yet.
    pub fn received(&self) -> usize {
        self.received
    }

    /// Whether the stream stands between two frames: no byte of an unfinished frame has come.
    pub fn is_at_border(&self) -> bool {
        self.received == 0 && self.passed_over == 0
    }

    /// Bytes of memory that the buffer holds.
    pub fn capacity(&self) -> usize {
        self.storage.capacity()
    }

    fn take_front(&mut self) -> Result<Option<Frame>, FrameError> {
        let received = self.storage.get(..self.received).unwrap_or_default();
        let front = match &mut self.front {
            Some(front) => front,
            empty => {
                let Some(raw) = received.first_chunk::<HEADER_LEN>() else {
                    // A peer that speaks something else may never send a header's worth of bytes.
                    check_magic(received)?;
                    return Ok(None);
                };
                let (header, crc) = Header::decode(raw, &self.limits)?;
                empty.insert(Front { header, summed: HEADER_LEN, crc })
            }
        };
        let frame_len = front.header.frame_len();
        let there = frame_len.min(received.len());
        let fresh = received.get(front.summed..there).unwrap_or_default();
        front.crc = crc32c::crc32c_append(front.crc, fresh);
        front.summed = there;
        if there < frame_len {
            return Ok(None);
        }
        let Front { header, crc, .. } = *front;
        if crc != header.frame_crc {
            return Err(FrameError::Checksum { stated: header.frame_crc, computed: crc });
        }
        let mut payload = self.storage.split_to(frame_len);
        payload.advance(HEADER_LEN);
        self.received -= frame_len;
        self.front = None;
        if self.received == 0 && self.storage.capacity() > KEPT_LEN_MAX {
            self.storage = BytesMut::new();
        }
        Ok(Some(Frame { header, payload: payload.freeze() }))
    }
}

/// Chosen: least free bytes for one read; with fewer a read call costs more than growing the buffer.
const SPARE_LEN_MIN: usize = 4 * 1024;
/// Chosen: least step, in bytes, by which the buffer grows; the usual size of a socket's buffer.
const STEP_LEN_MIN: usize = 64 * 1024;
/// Chosen: bytes of memory that the buffer of an idle connection may keep.
const KEPT_LEN_MAX: usize = 256 * 1024;

#[cfg(test)]
mod tests {
    use super::*;

    fn frame(kind: u16, request_id: u64, payload: &[u8]) -> Vec<u8> {
        let payload_len = u32::try_from(payload.len()).unwrap();
        let mut bytes = Header::encode(kind, request_id, payload_len, payload).to_vec();
        bytes.extend_from_slice(payload);
        bytes
    }

    #[test]
    fn every_prefix_is_not_yet_and_its_end_is_truncated() {
        let bytes = frame(8, 3, &[1; 40]);
        for cut in 0..bytes.len() {
            let mut buffer = FrameBuffer::new(Limits::default());
            buffer.feed(&bytes[..cut]);
            assert_eq!(buffer.next_frame(), Ok(None), "after {cut} bytes");
            let frame_len = (cut >= HEADER_LEN).then_some(bytes.len());
            let end = match cut {
                0 => Ok(()),
                received => Err(FrameError::Truncated { received, frame_len }),
            };
            assert_eq!(buffer.finish(), end);
        }
    }

    #[test]
    fn every_single_bit_flip_is_an_error_that_stays() {
        let bytes = frame(8, 3, &[0x5a; 24]);
        for bit in 0..bytes.len() * 8 {
            let mut damaged = bytes.clone();
            damaged[bit / 8] ^= 1 << (bit % 8);
            let mut buffer = FrameBuffer::new(Limits::default());
            buffer.feed(&damaged);
            let error = buffer.next_frame().expect_err("a damaged frame must not pass");
            assert_eq!(buffer.next_frame(), Err(error), "the error stays");
        }
    }

    #[test]
    fn something_else_is_refused_at_its_first_wrong_byte() {
        let mut buffer = FrameBuffer::new(Limits::default());
        buffer.feed(b"S");
        assert_eq!(buffer.next_frame(), Ok(None));
        buffer.feed(b"SH-2.0");
        assert_eq!(buffer.next_frame(), Err(FrameError::Magic { found: b"SS".to_vec() }));
    }

    #[test]
    fn oversized_length_fails_before_its_payload_arrives() {
        let limits = Limits { payload_len_max: 1000, ..Limits::default() };
        let header = Header::encode(8, 0, 1001, &[]);
        let mut buffer = FrameBuffer::new(limits);
        buffer.feed(&header);
        assert!(matches!(buffer.next_frame(), Err(FrameError::PayloadTooLong { .. })));
        assert_eq!(buffer.capacity(), 0);
    }

    #[test]
    fn announced_length_takes_no_memory() {
        let mut buffer = FrameBuffer::new(Limits::default());
        buffer.feed(&Header::encode(8, 0, 256 << 20, &[]));
        for received in 1..3000_usize {
            assert_eq!(buffer.next_frame(), Ok(None));
            buffer.feed(&[0; 100]);
            let most = 4 * (HEADER_LEN + 100 * received) + 256 * 1024;
            assert!(buffer.capacity() <= most, "{} bytes of memory", buffer.capacity());
        }
    }

    #[test]
    fn memory_of_a_large_frame_is_given_back() {
        let bytes = frame(4, 1, &vec![3; 3 << 20]);
        let mut buffer = FrameBuffer::new(Limits::default());
        for piece in bytes.chunks(9999) {
            assert_eq!(buffer.next_frame(), Ok(None));
            buffer.feed(piece);
        }
        let taken = buffer.next_frame().unwrap().unwrap();
        assert_eq!(taken.payload, bytes[HEADER_LEN..]);
        drop(taken);
        assert!(buffer.capacity() <= KEPT_LEN_MAX, "{} bytes kept", buffer.capacity());
    }

    #[test]
    fn frame_that_is_passed_over_takes_no_memory_and_the_next_one_is_whole() {
        let (large, next) = (frame(4, 1, &vec![7; 1 << 20]), frame(8, 2, b"next"));
        for (piece, before) in [(1000, 5000), (9999, 40_000), (1 << 20, HEADER_LEN)] {
            let mut buffer = FrameBuffer::new(Limits::default());
            buffer.feed(&large[..before]);
            assert_eq!(buffer.next_frame(), Ok(None));
            assert_eq!(buffer.header().map(|header| header.request_id), Some(1));
            buffer.pass_over();
            assert!(!buffer.is_at_border() && buffer.header().is_none());
            assert!(matches!(buffer.finish(), Err(FrameError::Truncated { .. })));
            let rest = [&large[before..], &next, &next[..9]].concat();
            for piece in rest.chunks(piece) {
                buffer.feed(piece);
                assert!(buffer.capacity() <= 2 * STEP_LEN_MIN + piece.len());
                while let Some(frame) = buffer.next_frame().unwrap() {
                    assert_eq!((frame.request_id(), &frame.payload[..]), (2, &b"next"[..]));
                }
            }
            assert_eq!(buffer.received(), 9, "what came after it stays");
        }
    }

    #[test]
    fn memory_is_no_more_than_was_said_before() {
        let bytes = frame(4, 1, &vec![3; 3 << 20]);
        let mut buffer = FrameBuffer::new(Limits::default());
        for piece in bytes.chunks(5000) {
            let wanted = buffer.len_wanted();
            assert_eq!(buffer.spare_mut().len() + buffer.received(), wanted);
            buffer.feed(piece);
            let _ = buffer.next_frame().unwrap();
        }
    }

    #[test]
    fn frames_taken_late_do_not_change_under_later_bytes() {
        let mut buffer = FrameBuffer::new(Limits::default());
        let mut taken = Vec::new();
        for round in 0..200_u8 {
            buffer.feed(&frame(8, u64::from(round), &vec![round; 1500]));
            taken.push(buffer.next_frame().unwrap().unwrap());
        }
        for (round, frame) in taken.iter().enumerate() {
            assert_eq!(frame.request_id(), round as u64);
            assert!(frame.payload.iter().all(|byte| usize::from(*byte) == round));
        }
    }
}
