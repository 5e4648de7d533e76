//! Joints that another part of the program hands on: no port is listened on.

use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Instant;

use super::queue::{ArrivedBytes, ArrivedQueue};
use super::record::JointsRecord;

/// Hands records of joints from another part of the program to the hand that follows them; clones share
/// one queue.
///
/// The queue is bounded as that of the listener: the oldest pieces are dropped where nobody takes them.
#[derive(Clone, Debug, Default)]
pub struct JointsFeed(Arc<Shared>);

#[derive(Debug, Default)]
struct Shared {
    queue: ArrivedQueue,
    senders: AtomicUsize,
}

impl JointsFeed {
    /// Adds a record to the queue as its line of joints; `arrived` is the time of its arrival.
    pub fn hand_on(&self, record: &JointsRecord, arrived: Instant) {
        let bytes = record.to_webxr_line().into_bytes();
        self.0.queue.push(ArrivedBytes { arrived, datagram: true, bytes });
    }

    /// All that has come since the last call, oldest first. Never waits.
    pub fn take(&self) -> Vec<ArrivedBytes> {
        self.0.queue.take()
    }

    /// Number of pieces that were thrown away because they were not taken in time.
    pub fn dropped(&self) -> u64 {
        self.0.queue.dropped()
    }

    /// Sets the number of senders.
    pub fn set_senders(&self, senders: usize) {
        self.0.senders.store(senders, Ordering::Relaxed);
    }

    /// Number of senders.
    pub fn senders(&self) -> usize {
        self.0.senders.load(Ordering::Relaxed)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::joints::{JointsEvent, JointsParser, record_of_hand};
    use nalgebra::Isometry3;
    use softgrasp_grasp::hand::{HandDimensions, JointAngles};

    #[test]
    fn record_that_is_handed_on_is_read_as_it_was_but_for_the_palm() {
        let feed = JointsFeed::default();
        let dimensions = HandDimensions::default();
        let palm = Isometry3::translation(0.1, 0.2, 0.3);
        let mut record = record_of_hand(&dimensions, &JointAngles::fist(), &palm);
        record.frame = Some(41);
        feed.hand_on(&record, Instant::now());
        let pieces = feed.take();
        let [piece] = &pieces[..] else { panic!("{pieces:?}") };
        let mut read = Vec::new();
        JointsParser::new().feed_datagram(&piece.bytes, &mut |event| match event {
            JointsEvent::Record(record) => read.push(*record),
            JointsEvent::Fault(fault) => panic!("{fault:?}"),
        });
        record.joints[0] = None;
        assert_eq!(read, [record]);
        assert!(feed.take().is_empty());
    }
}
