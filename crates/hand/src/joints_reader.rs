//! Reads a hand from a stream of joints.

use nalgebra::{Isometry3, Translation3, Vector3};
use serde::Serialize;
use softgrasp_grasp::hand::{HandDimensions, Handedness, JointAngles};

use crate::joints::{
    Doubts, FittedHand, HandFit, JointsEvent, JointsParser, JointsRecord, fitted_dimensions,
};

/// Joints of one hand, and the kinematic hand that follows them.
pub struct JointsReader {
    parser: JointsParser,
    fit: HandFit,
    /// Side of the hand that is followed: that of the first record, `None` before it.
    side: Option<Handedness>,
    /// Side of the run's other hand, which is not followed here.
    taken: Option<Handedness>,
    /// Records of the other hand that have come and were not taken.
    others: Vec<JointsRecord>,
    /// Records that the hand is measured by, until there are enough.
    measured: Vec<JointsRecord>,
    /// Where the sender's frame lies in the world; `None` until the first hand.
    world_from_sender: Option<Isometry3<f64>>,
    newest: Option<(FittedHand, f64)>,
    /// Number that the sender gave the newest record that was fitted, and the one before it.
    number: Option<u64>,
    number_before: Option<u64>,
    faults: u64,
    fit_errors: FitErrors,
    doubts: Doubts,
    /// When the first hand came, s.
    first_s: Option<f64>,
}

/// How well the kinematic hand fits a sender's joints, over a run.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct FitErrors {
    /// Number of records that were fitted.
    pub records: u64,
    /// Root of the mean squared distance of joints, over all records, m.
    pub rms_m: f64,
    /// Largest distance of a joint, m.
    pub most_m: f64,
}

impl FitErrors {
    /// Errors of the records of both.
    #[must_use]
    pub fn with(&self, other: &Self) -> Self {
        let records = self.records + other.records;
        if records == 0 {
            return Self::default();
        }
        let squares = |errors: &Self| errors.rms_m.powi(2) * errors.records as f64;
        let rms_m = match (self.records, other.records) {
            // A mean of one kind keeps its bits.
            (_, 0) => self.rms_m,
            (0, _) => other.rms_m,
            _ => ((squares(self) + squares(other)) / records as f64).sqrt(),
        };
        Self { records, rms_m, most_m: self.most_m.max(other.most_m) }
    }
}

/// Number of records by which a hand is measured; before these it has the usual size.
const MEASURED: usize = 30;
/// Number of records of the other hand that wait at most.
const OTHERS_MAX: usize = 64;
/// Number of fitted records after which the sender is described to the person.
const INTRODUCED_AFTER: u64 = 60;
/// The first palm is placed here in the world, m: before the object, to the right of its middle.
const FIRST_PALM_M: Vector3<f64> = Vector3::new(0.0, 0.08, 0.16);

impl JointsReader {
    /// A reader for a hand; its size is taken from the stream.
    ///
    /// Frame: `world_from_sender` places the sender's frame; `None` places the first palm before the
    /// object.
    pub fn new(dimensions: HandDimensions, world_from_sender: Option<Isometry3<f64>>) -> Self {
        Self {
            parser: JointsParser::new(),
            fit: HandFit::new(dimensions),
            side: None,
            taken: None,
            others: Vec::new(),
            measured: Vec::new(),
            world_from_sender,
            newest: None,
            number: None,
            number_before: None,
            faults: 0,
            fit_errors: FitErrors::default(),
            doubts: Doubts::default(),
            first_s: None,
        }
    }

    /// Takes bytes that came at a time, s; returns, once, a sentence that describes the sender. Records of
    /// the other hand wait for [`JointsReader::take_others`].
    pub fn feed(&mut self, bytes: &[u8], is_datagram: bool, time_s: f64) -> Option<String> {
        let mut records = Vec::new();
        let mut faults = Vec::new();
        let mut on_event = |event| match event {
            JointsEvent::Record(record) => records.push(*record),
            JointsEvent::Fault(fault) => {
                tracing::debug!(?fault, "joints");
                faults.push(fault.kind);
            }
        };
        if is_datagram {
            self.parser.feed_datagram(bytes, &mut on_event);
        } else {
            self.parser.feed_all(bytes, &mut on_event);
        }
        self.faults += faults.len() as u64;
        faults.iter().for_each(|fault| self.doubts.fault(fault));
        let told = records.iter().filter_map(|record| self.take(record, time_s));
        told.collect::<Vec<_>>().pop()
    }

    /// Takes a record that came at a time, s, as [`JointsReader::feed`] does.
    pub fn take(&mut self, record: &JointsRecord, time_s: f64) -> Option<String> {
        let is_ours = match self.side {
            Some(side) => record.hand == side,
            None => self.taken != Some(record.hand),
        };
        if !is_ours {
            if self.others.len() < OTHERS_MAX {
                self.others.push(*record);
            }
            return None;
        }
        self.follow(record, time_s)
    }

    /// Records of the other hand that have come since the last call.
    pub fn take_others(&mut self) -> Vec<JointsRecord> {
        std::mem::take(&mut self.others)
    }

    /// Side of the hand that is followed; `None` before the first record.
    pub fn side(&self) -> Option<Handedness> {
        self.side
    }

    /// Leaves the hand of this side to another reader.
    pub fn leave(&mut self, side: Handedness) {
        self.taken = Some(side);
    }

    /// Pose of the sender's frame in the world; `None` until it is known.
    pub fn world_from_sender(&self) -> Option<Isometry3<f64>> {
        self.world_from_sender
    }

    /// Places the sender's frame in the world, unless its place is known.
    pub fn place_sender(&mut self, world_from_sender: Isometry3<f64>) {
        self.world_from_sender.get_or_insert(world_from_sender);
    }

    /// Number of bad lines and of records that no hand fits.
    pub fn faults(&self) -> u64 {
        self.faults
    }

    /// What is wrong with the stream as a whole, in a sentence; `None` while nothing seems to be.
    pub fn doubt(&self) -> Option<String> {
        self.doubts.sentence()
    }

    /// The sentence that describes the sender, once enough records are fitted: hand, unit, rate and fit.
    fn introduction(&self, time_s: f64) -> Option<String> {
        let first_s = self.first_s?;
        let FitErrors { records, rms_m, .. } = self.fit_errors;
        let is_time = records == INTRODUCED_AFTER && time_s > first_s;
        is_time.then(|| {
            let hand = self.fit.dimensions().handedness.name();
            let rate = (records - 1) as f64 / (time_s - first_s);
            let mm = 1e3 * rms_m;
            format!("joints of a {hand} hand, metres, {rate:.0} a second, fitted to {mm:.1} mm")
        })
    }

    /// How well the kinematic hand fits the sender's joints.
    pub fn fit_errors(&self) -> FitErrors {
        self.fit_errors
    }

    /// Dimensions of the hand.
    pub fn dimensions(&self) -> &HandDimensions {
        self.fit.dimensions()
    }

    /// When the newest record came, s.
    pub fn time_s(&self) -> Option<f64> {
        self.newest.map(|(_, time_s)| time_s)
    }

    /// Number that the sender gave the newest record that was fitted.
    pub fn number(&self) -> Option<u64> {
        self.number
    }

    /// Number of the record that was fitted before the newest one.
    pub fn number_before(&self) -> Option<u64> {
        self.number_before
    }

    /// Joint angles and palm (world) by the newest record.
    pub fn measured(&self) -> Option<(JointAngles, Isometry3<f64>)> {
        let (fitted, _) = self.newest?;
        Some((fitted.angles, self.world_from_sender? * fitted.world_from_palm))
    }

    /// Fits the hand to a record; returns, once, the sentence that describes the sender.
    fn follow(&mut self, record: &JointsRecord, time_s: f64) -> Option<String> {
        // Of a stream in another unit no joint is where it says.
        if !self.doubts.is_of_human_size(record) {
            self.faults += 1;
            return None;
        }
        self.side = Some(record.hand);
        self.measure(record);
        match self.fit.fit(record) {
            Ok(fitted) => {
                self.world_from_sender.get_or_insert_with(|| {
                    let first = fitted.world_from_palm.translation.vector;
                    Translation3::from(FIRST_PALM_M - first).into()
                });
                self.newest = Some((fitted, time_s));
                self.number_before = std::mem::replace(&mut self.number, record.frame);
                let errors = &mut self.fit_errors;
                let squares = errors.rms_m.powi(2) * errors.records as f64;
                errors.records += 1;
                let mean = (squares + fitted.fit_error_rms_m.powi(2)) / errors.records as f64;
                errors.rms_m = mean.sqrt();
                errors.most_m = errors.most_m.max(fitted.fit_error_max_m);
                self.first_s.get_or_insert(time_s);
                self.doubts.fitted(record, &fitted, self.fit.dimensions());
                self.introduction(time_s)
            }
            Err(error) => {
                tracing::debug!(%error, "joints");
                self.faults += 1;
                None
            }
        }
    }

    /// Takes the hand's side from the first record and its size from the first ones.
    fn measure(&mut self, record: &JointsRecord) {
        if self.measured.len() >= MEASURED {
            return;
        }
        if self.measured.is_empty() {
            let dimensions = self.fit.dimensions().with_handedness(record.hand);
            self.fit = HandFit::new(dimensions);
        }
        self.measured.push(*record);
        if self.measured.len() == MEASURED
            && let Ok(dimensions) = fitted_dimensions(&self.measured)
        {
            self.fit = HandFit::new(dimensions);
        }
    }
}

#[cfg(test)]
mod tests {
    use softgrasp_grasp::hand::Handedness;

    use super::*;
    use crate::joints::record_of_hand;

    #[test]
    fn other_hand_of_a_stream_is_not_fitted_and_waits_for_its_own_reader() {
        let record = |side| {
            let hand = HandDimensions::default().with_handedness(side);
            record_of_hand(&hand, &JointAngles::flat(), &Isometry3::translation(0.1, 0.2, 0.3))
        };
        let (left, right) = (record(Handedness::Left), record(Handedness::Right));
        let mut reader = JointsReader::new(HandDimensions::default(), None);
        assert_eq!(reader.side(), None);
        for record in [&left, &right, &left] {
            reader.take(record, 0.0);
        }
        assert_eq!((reader.side(), reader.fit_errors().records), (Some(Handedness::Left), 2));
        assert_eq!(reader.take_others(), [right]);
        let mut other = JointsReader::new(HandDimensions::default(), None);
        other.leave(Handedness::Left);
        other.take(&left, 0.0);
        assert_eq!((other.side(), other.take_others()), (None, vec![left]));
        other.take(&right, 0.0);
        assert_eq!((other.side(), other.fit_errors().records), (Some(Handedness::Right), 1));
    }

    #[test]
    fn who_speaks_is_told_once_with_hand_unit_rate_and_fit() {
        for (side, name) in [(Handedness::Right, "right"), (Handedness::Left, "left")] {
            let hand = HandDimensions::default().with_handedness(side);
            let mut reader = JointsReader::new(HandDimensions::default(), None);
            let mut told = Vec::new();
            for i in 0..300 {
                let closed = 0.5 - 0.5 * (0.2 * f64::from(i)).cos();
                let angles = JointAngles::flat().lerp(&JointAngles::fist(), closed);
                let palm = Isometry3::translation(0.1, 0.2, 1e-3 * f64::from(i));
                let line = format!("{}\n", record_of_hand(&hand, &angles, &palm).to_line());
                told.extend(reader.feed(line.as_bytes(), true, f64::from(i) / 30.0));
            }
            let [said] = &told[..] else { panic!("{told:?}") };
            let words = format!("joints of a {name} hand, metres, 30 a second, fitted to ");
            assert!(said.starts_with(&words) && said.ends_with(" mm"), "{said}");
        }
    }
}
