//! The way out of a device: bytes leave at the speed of the line, and faults of the line hit them.

use std::collections::VecDeque;

use super::fault::{Fault, Faults};

/// Time for which a burst holds everything back, s.
const BURST_S: f64 = 0.15;
/// Duration of a silence, s.
const SILENCE_S: f64 = 1.2;

/// Bytes on their way out.
#[derive(Clone, Debug)]
pub(super) struct OutLine {
    /// Bytes that wait, each with the time at which they may begin to leave, s.
    queue: VecDeque<(f64, Vec<u8>)>,
    /// Time at which the last byte that left had left, s.
    busy_until_s: f64,
    byte_s: f64,
    /// Bytes that have left and are held back by a burst.
    held: Vec<u8>,
    held_until_s: f64,
    silent_until_s: f64,
}

impl OutLine {
    /// A line of this speed: start bit, eight bits, stop bit.
    pub(super) fn new(baud: u32) -> Self {
        Self {
            queue: VecDeque::new(),
            busy_until_s: f64::NEG_INFINITY,
            byte_s: 10.0 / f64::from(baud.max(1)),
            held: Vec::new(),
            held_until_s: f64::NEG_INFINITY,
            silent_until_s: f64::NEG_INFINITY,
        }
    }

    /// Time that so many bytes take on the line, s.
    pub(super) fn duration_s(&self, bytes: usize) -> f64 {
        self.byte_s * bytes as f64
    }

    /// Number of bytes that have not left yet.
    pub(super) fn waiting(&self) -> usize {
        self.queue.iter().map(|(_, bytes)| bytes.len()).sum()
    }

    /// Whether the device neither hears nor speaks, because a silence lasts.
    pub(super) fn is_silent(&self, now_s: f64) -> bool {
        now_s < self.silent_until_s
    }

    /// Sends a reply, not before a time.
    pub(super) fn send(&mut self, bytes: Vec<u8>, not_before_s: f64) {
        if !bytes.is_empty() {
            self.queue.push_back((not_before_s, bytes));
        }
    }

    /// Sends a record that is ready at a time, with the faults that both devices can have.
    pub(super) fn send_record(&mut self, mut record: Vec<u8>, time_s: f64, faults: &mut Faults) {
        if self.is_silent(time_s) {
            return;
        }
        if faults.hits(Fault::Silence) {
            self.silent_until_s = time_s + SILENCE_S;
            return;
        }
        if time_s >= self.held_until_s && faults.hits(Fault::Burst) {
            self.held_until_s = time_s + BURST_S;
        }
        if faults.hits(Fault::Truncated) {
            record.truncate(1 + faults.chance.below(record.len().saturating_sub(1)));
        }
        if faults.hits(Fault::Noise) {
            record.truncate(1 + faults.chance.below(record.len()));
            record.iter_mut().for_each(|byte| *byte = faults.chance.byte());
        }
        if faults.hits(Fault::Duplicate) {
            self.send(record.clone(), time_s);
        }
        self.send(record, time_s);
    }

    /// Drops the bytes that have not left yet.
    pub(super) fn clear(&mut self) {
        self.queue.clear();
    }

    /// The bytes that have left by now.
    pub(super) fn take(&mut self, now_s: f64) -> Vec<u8> {
        self.advance(now_s);
        match now_s < self.held_until_s {
            true => Vec::new(),
            false => std::mem::take(&mut self.held),
        }
    }

    /// Lets the bytes leave that are due by now.
    pub(super) fn advance(&mut self, now_s: f64) {
        while let Some((not_before_s, bytes)) = self.queue.front_mut() {
            let begin_s = self.busy_until_s.max(*not_before_s);
            // A byte that is done within a billionth of its time is done.
            let done = ((now_s - begin_s) / self.byte_s + 1e-6).max(0.0) as usize;
            if done == 0 {
                break;
            }
            if done < bytes.len() {
                self.held.extend(bytes.drain(..done));
                self.busy_until_s = begin_s + self.byte_s * done as f64;
                *not_before_s = f64::NEG_INFINITY;
                break;
            }
            self.busy_until_s = begin_s + self.byte_s * bytes.len() as f64;
            self.held.append(bytes);
            self.queue.pop_front();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fault::FaultSetting;

    fn faults(fault: Fault, rate: f64) -> Faults {
        Faults::new(&[FaultSetting { fault, rate }], 1)
    }

    #[test]
    fn bytes_leave_at_the_speed_of_the_line_and_in_order() {
        // One byte per millisecond.
        let mut line = OutLine::new(10_000);
        line.send(vec![1, 2, 3], 1.0);
        line.send(vec![4], 1.0);
        line.send(vec![5], 2.0);
        assert_eq!(line.take(1.0), b"");
        assert_eq!(line.take(1.002), [1, 2]);
        assert_eq!(line.take(1.0035), [3]);
        assert_eq!(line.take(1.9), [4]);
        assert_eq!(line.take(2.0005), b"");
        assert_eq!(line.take(2.001), [5]);
        line.send(vec![9; 100], 0.0);
        assert_eq!(line.take(2.05).len(), 49, "the line was busy until 2.001");
    }

    #[test]
    fn a_burst_holds_everything_back_and_loses_nothing() {
        let mut line = OutLine::new(115_200);
        let mut faults = faults(Fault::Burst, 1.0);
        line.send_record(vec![1; 24], 0.0, &mut faults);
        line.send_record(vec![2; 24], 0.1, &mut faults);
        assert_eq!(line.take(0.14), b"");
        let burst = line.take(0.151);
        assert_eq!((burst.len(), burst[0], burst[47]), (48, 1, 2));
    }

    #[test]
    fn silence_ends_by_itself() {
        let mut line = OutLine::new(115_200);
        line.send_record(vec![1], 0.0, &mut faults(Fault::Silence, 1.0));
        assert!(line.is_silent(1.0) && !line.is_silent(1.3));
        let mut none = Faults::new(&[], 0);
        line.send_record(vec![2], 1.0, &mut none);
        line.send_record(vec![3], 1.3, &mut none);
        assert_eq!(line.take(2.0), [3]);
    }

    #[test]
    fn truncated_and_noisy_records_are_no_longer_than_they_were() {
        for fault in [Fault::Truncated, Fault::Noise] {
            let mut faults = faults(fault, 1.0);
            for length in 1..30 {
                let mut line = OutLine::new(115_200);
                line.send_record(vec![7; length], 0.0, &mut faults);
                let left = line.take(1.0).len();
                assert!((1..=length).contains(&left), "{fault} {length} {left}");
            }
        }
    }
}
