//! Bytes that have arrived and wait to be taken, never more than a fixed number.

use std::collections::VecDeque;
use std::sync::{Mutex, MutexGuard, PoisonError, TryLockError};
use std::time::Instant;

/// Most pieces that wait: those of ten seconds at 100 a second.
const PIECES_MAX: usize = 1024;
/// Most bytes that wait.
const BYTES_MAX: usize = 4 << 20;

/// Whole lines of one sender, as they came.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ArrivedBytes {
    /// When the last of these lines was read.
    pub arrived: Instant,
    /// Whether the lines came as one datagram; otherwise they came over a connection.
    pub datagram: bool,
    /// One or more lines, each with its LF, which is added where the sender left it out.
    pub bytes: Vec<u8>,
}

#[derive(Debug, Default)]
struct Waiting {
    pieces: VecDeque<ArrivedBytes>,
    bytes: usize,
    dropped: u64,
}

/// A queue between the thread that listens and the one that takes.
#[derive(Debug, Default)]
pub(super) struct ArrivedQueue(Mutex<Waiting>);

impl ArrivedQueue {
    /// Adds a piece; the oldest are dropped where there are too many.
    pub(super) fn push(&self, piece: ArrivedBytes) {
        let mut waiting = self.lock();
        waiting.bytes += piece.bytes.len();
        waiting.pieces.push_back(piece);
        while waiting.pieces.len() > PIECES_MAX || waiting.bytes > BYTES_MAX {
            let Some(oldest) = waiting.pieces.pop_front() else { return };
            waiting.bytes -= oldest.bytes.len();
            waiting.dropped += 1;
        }
    }

    /// All that waits, oldest first; nothing while another thread is adding. Never waits.
    pub(super) fn take(&self) -> Vec<ArrivedBytes> {
        let mut waiting = match self.0.try_lock() {
            Ok(waiting) => waiting,
            Err(TryLockError::Poisoned(poisoned)) => poisoned.into_inner(),
            Err(TryLockError::WouldBlock) => return Vec::new(),
        };
        waiting.bytes = 0;
        std::mem::take(&mut waiting.pieces).into()
    }

    /// Number of pieces that were dropped since the start.
    pub(super) fn dropped(&self) -> u64 {
        self.lock().dropped
    }

    fn lock(&self) -> MutexGuard<'_, Waiting> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn piece(bytes: Vec<u8>) -> ArrivedBytes {
        ArrivedBytes { arrived: Instant::now(), datagram: true, bytes }
    }

    #[test]
    fn the_newest_pieces_wait_and_the_others_are_counted() {
        let queue = ArrivedQueue::default();
        for number in 0..PIECES_MAX + 10 {
            queue.push(piece(number.to_le_bytes().to_vec()));
        }
        let taken = queue.take();
        assert_eq!((taken.len(), queue.dropped()), (PIECES_MAX, 10));
        assert_eq!(taken[0].bytes, 10usize.to_le_bytes());
        assert!(queue.take().is_empty());
        for _ in 0..100 {
            queue.push(piece(vec![0; BYTES_MAX / 10]));
        }
        assert_eq!((queue.take().len(), queue.dropped()), (10, 100));
    }

    #[test]
    fn taking_never_waits() {
        let queue = ArrivedQueue::default();
        queue.push(piece(vec![1]));
        let guard = queue.lock();
        assert!(queue.take().is_empty());
        drop(guard);
        assert_eq!(queue.take().len(), 1);
    }
}
