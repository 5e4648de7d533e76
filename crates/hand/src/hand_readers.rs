//! Readers of the hands of a run: one hand, or a left and a right one at once.

use softgrasp_grasp::hand::{HandPose, Handedness};

use crate::hand_reader::{DeviceFaults, HandReader, SAMPLE_AGE_MAX_S};
use crate::joints_reader::FitErrors;
use crate::notice::Notice;
use crate::sent::{Arrival, SilentDevice, WhichHand};

/// Readers of one hand or of two.
pub struct HandReaders {
    first: HandReader,
    second: Option<SecondReader>,
    /// Side of a hand that was sent and that nobody follows.
    left_over: Option<Handedness>,
}

/// Reader of the second hand.
struct SecondReader {
    reader: HandReader,
    /// Whether the hand comes in the first one's stream of joints, which carries both.
    shares_stream: bool,
    /// Whether senders of joints stand in one frame of which nobody has said where it lies: that of the first
    /// hand that comes places it.
    shares_frame: bool,
}

impl From<HandReader> for HandReaders {
    fn from(first: HandReader) -> Self {
        Self { first, second: None, left_over: None }
    }
}

impl HandReaders {
    /// Readers of two hands with devices of their own.
    pub fn of_two(first: HandReader, second: HandReader) -> Self {
        Self::of_both(first, second, false)
    }

    /// Readers of two hands that come in one stream of joints: the first is that of the first record.
    pub fn of_stream(first: HandReader, second: HandReader) -> Self {
        Self::of_both(first, second, true)
    }

    fn of_both(mut first: HandReader, mut reader: HandReader, shares_stream: bool) -> Self {
        let places = [&mut first, &mut reader].map(|r| r.joints_mut().world_from_sender());
        let shares_frame = places.iter().all(Option::is_none);
        Self {
            first,
            second: Some(SecondReader { reader, shares_stream, shares_frame }),
            left_over: None,
        }
    }

    /// Reader of the first hand, or the only one.
    pub fn first(&self) -> &HandReader {
        &self.first
    }

    /// Reader of the second hand.
    pub fn second(&self) -> Option<&HandReader> {
        self.second.as_ref().map(|second| &second.reader)
    }

    /// Reader of a hand.
    pub fn of(&self, which: WhichHand) -> Option<&HandReader> {
        match which {
            WhichHand::First => Some(&self.first),
            WhichHand::Second => self.second(),
        }
    }

    fn all(&self) -> impl Iterator<Item = &HandReader> {
        std::iter::once(&self.first).chain(self.second())
    }

    /// Takes bytes of the devices, in the order in which they came. Bytes of a second hand in a run of one
    /// are dropped.
    ///
    /// Units: `now_s` s on the client's clock, the time of bytes that come with the tick.
    pub fn feed(&mut self, arrivals: &[Arrival], now_s: f64) {
        for arrival in arrivals {
            let one = std::slice::from_ref(arrival);
            match (arrival.hand, &mut self.second) {
                (WhichHand::First, _) => self.first.feed(one, now_s),
                (WhichHand::Second, Some(second)) => second.reader.feed(one, now_s),
                (WhichHand::Second, None) => {}
            }
            self.share(arrival.at_s.unwrap_or(now_s));
        }
    }

    /// Shares between both hands what concerns both: who has which side, the place of the tracker's frame, and
    /// a stream that brings both, of which records came at a time, s.
    fn share(&mut self, time_s: f64) {
        let others = self.first.joints_mut().take_others();
        let Some(SecondReader { reader: second, shares_stream, shares_frame }) = &mut self.second
        else {
            self.left_over = others.last().map(|record| record.hand).or(self.left_over);
            return;
        };
        let first = &mut self.first;
        if let Some(side) = first.side() {
            second.joints_mut().leave(side);
        }
        // Hands that one tracker sees, or two that were brought into one frame, keep their places to each other.
        if let (true, Some(place)) = (*shares_frame, first.joints_mut().world_from_sender()) {
            second.joints_mut().place_sender(place);
        }
        match *shares_stream {
            true => second.take_joints(&others, time_s),
            false => self.left_over = others.last().map(|record| record.hand).or(self.left_over),
        }
        if let Some(side) = second.side() {
            first.joints_mut().leave(side);
        }
        if let (true, Some(place)) = (*shares_frame, second.joints_mut().world_from_sender()) {
            first.joints_mut().place_sender(place);
        }
        // What comes from a sender of its own and says the first hand's side is followed by nobody.
        let unfollowed = second.joints_mut().take_others();
        self.left_over = unfollowed.last().map(|record| record.hand).or(self.left_over);
    }

    /// Number of hands of which a pose is known.
    pub fn heard(&self, now_s: f64) -> usize {
        self.all().filter(|reader| reader.measured(now_s).is_some()).count()
    }

    /// Poses of both hands by the newest samples, however old; `None` for one that is not known.
    pub fn hands(&self, now_s: f64) -> [Option<HandPose>; 2] {
        WhichHand::ALL.map(|which| self.of(which)?.hand(now_s))
    }

    /// Devices from which nothing good has come for too long. A second hand that comes in the first one's
    /// stream may be out of sight: it is silent once it has been seen.
    pub fn silent(&self, now_s: f64) -> Vec<SilentDevice> {
        let is_two = self.is_two(now_s);
        let of = |reader: &HandReader| {
            let side = is_two.then_some(reader.setup().dimensions.handedness);
            let devices = reader.silent(now_s).into_iter();
            devices.map(|device| SilentDevice { device, side }).collect::<Vec<_>>()
        };
        self.all().flat_map(of).collect()
    }

    /// Whether a second hand has devices of its own, or was seen in the first one's stream.
    fn is_two(&self, now_s: f64) -> bool {
        let is_there = |second: &SecondReader| {
            !second.shares_stream || second.reader.measured(now_s).is_some()
        };
        self.second.as_ref().is_some_and(is_there)
    }

    /// When the first byte came of the oldest sample of the hands that are not silent, s; `None` before a
    /// hand.
    pub fn sample_time_s(&self, now_s: f64) -> Option<f64> {
        let times = || self.all().filter_map(|reader| reader.sample_time_s(now_s));
        let fresh = times().filter(|time_s| now_s - time_s <= SAMPLE_AGE_MAX_S).reduce(f64::min);
        fresh.or_else(|| times().reduce(f64::max))
    }

    /// Counts of faults of all devices since the start.
    pub fn faults(&self) -> DeviceFaults {
        let sum = |a: DeviceFaults, b: DeviceFaults| DeviceFaults {
            glove: a.glove + b.glove,
            tracker: a.tracker + b.tracker,
            hemisphere_flips: a.hemisphere_flips + b.hemisphere_flips,
            glove_jumps: a.glove_jumps + b.glove_jumps,
            tracker_jumps: a.tracker_jumps + b.tracker_jumps,
            joints: a.joints + b.joints,
        };
        self.all().map(HandReader::faults).fold(DeviceFaults::default(), sum)
    }

    /// How well the kinematic hands fit a sender's joints.
    pub fn fit_errors(&self) -> FitErrors {
        self.all().map(HandReader::fit_errors).fold(FitErrors::default(), |a, b| a.with(&b))
    }

    /// What is wrong with what the devices send, a sentence each; none while all is as it should be.
    pub fn complaints(&self) -> Vec<String> {
        let of_readers = self.all().flat_map(HandReader::complaints);
        let unfollowed = self.left_over.map(|side| match self.second {
            None => format!("a {} hand is sent too: this run follows one hand", side.name()),
            Some(_) => format!(
                "a {} hand is sent that is not followed: the run has two hands, and another source is \
                 the {0} one",
                side.name()
            ),
        });
        of_readers.chain(unfollowed).collect()
    }

    /// What is to be told of the devices since the last call, with the hand where both have their own.
    pub fn take_news(&mut self) -> Vec<Notice> {
        let mut news = self.first.take_news();
        let Some(SecondReader { reader: second, shares_stream, .. }) = &mut self.second else {
            return news;
        };
        let of_second = second.take_news();
        if *shares_stream {
            news.extend(of_second);
            return news;
        }
        let named = |reader: &HandReader, told: Vec<Notice>| -> Vec<Notice> {
            let side = reader.setup().dimensions.handedness.name();
            let name =
                |Notice { text, kind }| Notice { text: format!("{side} hand: {text}"), kind };
            told.into_iter().map(name).collect()
        };
        [named(&self.first, news), named(second, of_second)].concat()
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::{Isometry3, Vector3};
    use softgrasp_grasp::hand::{HandDimensions, JointAngles};

    use super::*;
    use crate::hand_setup::HandSetup;
    use crate::joints::record_of_hand;
    use crate::sent::Device;

    const PALM_M: Vector3<f64> = Vector3::new(0.3, 1.1, -0.4);

    /// Line of a hand whose palm is at the mirror image of a place for a left one.
    fn seen(which: WhichHand, side: Handedness) -> Arrival {
        let hand = HandDimensions::default().with_handedness(side);
        let x = if side == Handedness::Left { -PALM_M.x } else { PALM_M.x };
        let palm = Isometry3::translation(x, PALM_M.y, PALM_M.z);
        let line = record_of_hand(&hand, &JointAngles::flat(), &palm).to_line();
        let arrival = Arrival::with_tick(Device::Joints, line.into_bytes());
        Arrival { hand: which, is_datagram: true, ..arrival }
    }

    fn reader() -> HandReader {
        HandReader::of_devices(HandSetup::default(), None)
    }

    fn apart_m(readers: &HandReaders) -> Vector3<f64> {
        let [first, second] = readers.hands(0.0).map(|hand| hand.unwrap().world_from_palm);
        second.translation.vector - first.translation.vector
    }

    #[test]
    fn hands_of_one_stream_keep_their_places_to_each_other() {
        let mut readers = HandReaders::of_stream(reader(), reader());
        readers.feed(&[seen(WhichHand::First, Handedness::Left)], 0.0);
        assert_eq!((readers.heard(0.0), readers.silent(1.0).len()), (1, 1));
        assert_eq!(readers.silent(1.0)[0].side, None, "there is one hand so far");
        readers.feed(&[seen(WhichHand::First, Handedness::Right)], 0.0);
        let sides = WhichHand::ALL.map(|which| readers.of(which).unwrap().side());
        assert_eq!(sides, [Some(Handedness::Left), Some(Handedness::Right)]);
        assert!((apart_m(&readers) - Vector3::new(2.0 * PALM_M.x, 0.0, 0.0)).norm() < 1e-6);
        assert_eq!(readers.complaints(), Vec::<String>::new());
    }

    #[test]
    fn each_hand_of_one_stream_has_its_own_age() {
        let mut readers = HandReaders::of_stream(reader(), reader());
        let both = [Handedness::Right, Handedness::Left];
        readers.feed(&both.map(|side| seen(WhichHand::First, side)), 0.0);
        readers.feed(&[seen(WhichHand::First, Handedness::Left)], 1.0);
        let silent = readers.silent(1.0);
        assert_eq!(
            silent,
            [SilentDevice { device: Device::Joints, side: Some(Handedness::Right) }]
        );
        assert_eq!(silent[0].name(), "right hand's sender of joints");
        assert_eq!(readers.heard(1.0), 2, "it is held where it was");
    }

    #[test]
    fn senders_of_their_own_may_come_in_any_order_and_one_that_says_a_taken_side_is_told() {
        let mut readers = HandReaders::of_two(reader(), reader());
        readers.feed(&[seen(WhichHand::Second, Handedness::Right)], 0.0);
        readers.feed(&[seen(WhichHand::First, Handedness::Left)], 0.0);
        assert_eq!(readers.second().unwrap().side(), Some(Handedness::Right));
        assert!((apart_m(&readers) - Vector3::new(2.0 * PALM_M.x, 0.0, 0.0)).norm() < 1e-6);
        assert_eq!(readers.complaints(), Vec::<String>::new());
        let mut readers = HandReaders::of_two(reader(), reader());
        for which in WhichHand::ALL {
            readers.feed(&[seen(which, Handedness::Right)], 0.0);
        }
        assert_eq!(readers.heard(0.0), 1);
        assert!(readers.complaints()[0].contains("another source is the right one"));
    }

    #[test]
    fn second_hand_of_a_stream_is_told_in_a_run_of_one() {
        let mut readers = HandReaders::from(reader());
        let both = [Handedness::Right, Handedness::Left];
        readers.feed(&both.map(|side| seen(WhichHand::First, side)), 0.0);
        assert_eq!(readers.heard(0.0), 1);
        assert_eq!(readers.complaints(), ["a left hand is sent too: this run follows one hand"]);
    }

    #[test]
    fn glove_and_tracker_of_each_hand_are_read_for_themselves() {
        let right = HandSetup::default();
        let mut left = HandSetup::default();
        left.dimensions = left.dimensions.with_handedness(Handedness::Left);
        let mut readers =
            HandReaders::of_two(HandReader::new(right.clone()), HandReader::new(left.clone()));
        let palms = [0.1, -0.1].map(|x| Isometry3::translation(x, 0.05, 0.0));
        readers.feed(&right.arrivals_of(&JointAngles::flat(), &palms[0]), 0.0);
        assert_eq!(readers.heard(0.0), 1);
        let of_second = left.arrivals_of(&JointAngles::flat(), &palms[1]).into_iter();
        let of_second = of_second.map(|arrival| Arrival { hand: WhichHand::Second, ..arrival });
        readers.feed(&of_second.collect::<Vec<_>>(), 0.0);
        for (hand, palm) in readers.hands(0.0).iter().zip(&palms) {
            let off = hand.unwrap().world_from_palm.translation.vector - palm.translation.vector;
            assert!(off.norm() < 1e-3, "{off}");
        }
    }
}
