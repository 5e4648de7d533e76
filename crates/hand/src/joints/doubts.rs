//! What is wrong with a stream of joints as a whole: another unit, the other hand, lines that are no records.

use softgrasp_grasp::hand::HandDimensions;

use super::bones::hand_size;
use super::fault::JointsFaultKind;
use super::fit::{FittedHand, HandFit};
use super::record::JointsRecord;

/// What speaks for and against a stream being joints of a hand in metres.
#[derive(Clone, Debug, Default)]
pub struct Doubts {
    records: u64,
    faults: u64,
    /// First fault of a line.
    fault: Option<JointsFaultKind>,
    /// Length of the first hand of no human size, since the last that was of one, m.
    odd_length_m: Option<f64>,
    /// The last records that were fitted, each with its root mean square distance, m.
    fitted: Vec<(JointsRecord, f64)>,
    told: Option<String>,
}

/// Hands of people are between these lengths, with room for what trackers do, m.
const LENGTHS_M: [f64; 2] = [0.10, 0.30];
/// Units that a sender may use by mistake: how long one is, m, and their name.
const UNITS: [(f64, &str); 4] =
    [(1e-3, "millimetres"), (1e-2, "centimetres"), (0.0254, "inches"), (0.3048, "feet")];
/// Lines that must have come before anything is said of them.
const LINES_MIN: u64 = 30;
/// Records that are kept so that the other hand can be fitted to them.
const KEPT: usize = 60;
/// Step between the kept records that are tried: every sixth.
const TRIED_EVERY: usize = 6;
/// A hand that fits worse than this, root of the mean square, is doubted, m …
const DOUBT_M: f64 = 0.009;
/// … and believed to be the other one where that fits so much better.
const BETTER: f64 = 0.6;

impl Doubts {
    /// Notes that a line was no record, and why.
    pub fn fault(&mut self, kind: &JointsFaultKind) {
        self.faults += 1;
        self.fault.get_or_insert_with(|| kind.clone());
    }

    /// Whether a record is of a hand that a person may have, so that it can be followed.
    pub fn is_of_human_size(&mut self, record: &JointsRecord) -> bool {
        self.records += 1;
        let Ok(size) = hand_size(std::slice::from_ref(record)) else { return true };
        let is_human = (LENGTHS_M[0]..=LENGTHS_M[1]).contains(&size.length_m);
        match is_human {
            true => self.odd_length_m = None,
            false => _ = self.odd_length_m.get_or_insert(size.length_m),
        }
        is_human
    }

    /// Notes a record that was followed, and how well the hand fits it.
    pub fn fitted(&mut self, record: &JointsRecord, fitted: &FittedHand, hand: &HandDimensions) {
        if self.fitted.len() >= KEPT {
            self.judge_fit(hand);
            self.fitted.clear();
        }
        self.fitted.push((*record, fitted.fit_error_rms_m));
    }

    /// A sentence on what is wrong; `None` while nothing seems to be. It stays the same while the same is wrong:
    /// whoever tells a sentence once tells it once.
    pub fn sentence(&self) -> Option<String> {
        let lines = self.records + self.faults;
        if lines < LINES_MIN {
            return None;
        }
        if let Some(fault) = self.fault.as_ref().filter(|_| 10 * self.faults > 9 * lines) {
            let hint = match fault {
                JointsFaultKind::Range { .. } => ": they may be in millimetres; send metres",
                JointsFaultKind::JointCount { got: 21 } => {
                    "; a list of 21 has no metacarpals, `docs/joints.md` says which joints are needed"
                }
                JointsFaultKind::NotJson { has_no_number: true, .. } => {
                    "; numbers that are not finite are not JSON"
                }
                _ => "",
            };
            return Some(format!("the lines that come are no records of joints: {fault}{hint}"));
        }
        if let Some(length) = self.odd_length_m {
            let metres = |unit: f64| (LENGTHS_M[0]..=LENGTHS_M[1]).contains(&(unit * length));
            let unit = UNITS.iter().find(|(unit, _)| metres(*unit));
            let may_be = unit.map_or("send metres".to_owned(), |(_, name)| {
                format!("they seem to be in {name}; send metres")
            });
            return Some(format!("the joints are those of a hand {length:.3} m long: {may_be}"));
        }
        self.told.clone()
    }

    /// Doubts the last records where the hand fits them badly; the other hand is tried once.
    fn judge_fit(&mut self, hand: &HandDimensions) {
        let rms = mean(self.fitted.iter().map(|(_, rms)| *rms));
        let doubted = rms.filter(|rms| *rms >= DOUBT_M);
        self.told = doubted.map(|rms| self.told.take().unwrap_or_else(|| self.of_fit(hand, rms)));
    }

    /// What a bad fit says of the last records: that they are of the other hand, or of none.
    ///
    /// Units: `rms` m.
    fn of_fit(&self, hand: &HandDimensions, rms: f64) -> String {
        let other = hand.handedness.other();
        let mut fit = HandFit::new(hand.with_handedness(other));
        let tried = self.fitted.iter().step_by(TRIED_EVERY).filter_map(|(record, _)| {
            let record = JointsRecord { hand: other, ..*record };
            fit.fit(&record).ok().map(|fitted| fitted.fit_error_rms_m)
        });
        let rms_of_other = mean(tried).unwrap_or(f64::INFINITY);
        let (said, mm) = (hand.handedness.name(), 1e3 * rms);
        if rms_of_other < BETTER * rms {
            format!(
                "the joints fit a {} hand to {:.1} mm, and the {said} hand that they say they are to \
                 {mm:.1} mm: the sender says the wrong hand, mirrors an axis, or swaps two",
                other.name(),
                1e3 * rms_of_other,
            )
        } else {
            format!(
                "no hand fits the joints better than {mm:.1} mm (good trackers: 2 to 6 mm): look at the \
                 order of the joints and at the axes"
            )
        }
    }
}

fn mean(values: impl Iterator<Item = f64>) -> Option<f64> {
    let (sum, count) = values.fold((0.0, 0u32), |(sum, count), value| (sum + value, count + 1));
    (count > 0).then(|| sum / f64::from(count))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::joints::places::record_of_hand;
    use crate::joints_reader::JointsReader;
    use nalgebra::{Isometry3, Vector3};
    use softgrasp_grasp::hand::{Handedness, JointAngles};

    type Spoil = fn(&mut JointsRecord);

    /// What a reader says of a hand that opens and closes, whose records were spoilt.
    fn said_of(spoil: impl Fn(&mut JointsRecord)) -> (Option<String>, bool) {
        let hand = HandDimensions::default();
        let mut reader = JointsReader::new(hand, None);
        let mut said = Vec::new();
        for i in 0..300 {
            let closed = 0.5 - 0.5 * (0.2 * f64::from(i)).cos();
            let angles = JointAngles::flat().lerp(&JointAngles::fist(), closed);
            let turn = Vector3::new(0.02 * f64::from(i), -0.3, 0.2);
            let palm = Isometry3::new(Vector3::new(0.1, 0.2, 0.0), turn);
            let mut record = record_of_hand(&hand, &angles, &palm);
            spoil(&mut record);
            reader.feed(format!("{}\n", record.to_line()).as_bytes(), false, f64::from(i) / 30.0);
            said.extend(reader.doubt());
        }
        said.dedup();
        // A run tells a sentence once: it stays as it is while more of the same comes.
        assert!(said.len() <= 1, "{said:?}");
        (reader.doubt(), reader.measured().is_some())
    }

    fn scaled(factor: f64) -> impl Fn(&mut JointsRecord) {
        move |record| {
            record.joints.iter_mut().flatten().for_each(|joint| joint.position *= factor);
        }
    }

    #[test]
    fn joints_in_another_unit_give_no_hand_and_are_told() {
        for (factor, unit) in [(100.0, "centimetres"), (39.37, "inches"), (3.281, "feet")] {
            let (said, has_hand) = said_of(scaled(factor));
            let said = said.expect(unit);
            assert!(said.contains(unit) && !has_hand, "{unit}: {said}");
        }
        // Most joints of a hand in millimetres are beyond the range of coordinates.
        let (said, has_hand) = said_of(scaled(1000.0));
        let said = said.expect("millimetres");
        assert!(said.contains("millimetres") && !has_hand, "{said}");
    }

    #[test]
    fn mirrored_joints_swapped_axes_and_the_wrong_hand_are_told_and_a_good_hand_is_not() {
        let (said, has_hand) = said_of(|_| {});
        assert!(said.is_none() && has_hand, "{said:?}");
        let spoilt: [(&str, Spoil); 3] = [
            ("wrong hand", |record| record.hand = Handedness::Left),
            ("mirrors", |record| {
                record.joints.iter_mut().flatten().for_each(|j| j.position.x = -j.position.x);
            }),
            ("swaps", |record| {
                record.joints.iter_mut().flatten().for_each(|j| j.position.coords.swap_rows(1, 2));
            }),
        ];
        for (words, spoil) in spoilt {
            let (said, _) = said_of(spoil);
            let said = said.unwrap_or_else(|| panic!("{words}: nothing was said"));
            assert!(said.contains(words), "{words}: {said}");
        }
    }

    #[test]
    fn joints_that_are_not_finite_are_told_and_give_no_hand() {
        let hand = HandDimensions::default();
        let record = record_of_hand(&hand, &JointAngles::flat(), &Isometry3::identity());
        let line = record.to_line();
        let first = line.find("[[").expect("places of joints") + 2;
        let end = first + line[first..].find(',').expect("three coordinates");
        for number in ["NaN", "Infinity", "-inf"] {
            let mut reader = JointsReader::new(hand, None);
            let spoilt = format!("{}{number}{}\n", &line[..first], &line[end..]);
            for i in 0..60 {
                let told = reader.feed(spoilt.as_bytes(), false, f64::from(i) / 30.0);
                assert!(told.is_none(), "{number}: {told:?}");
            }
            let said = reader.doubt().unwrap_or_else(|| panic!("{number}: nothing was said"));
            assert!(said.contains("no records of joints") && said.contains("not finite"), "{said}");
            assert!(reader.measured().is_none(), "{number} moves a hand");
        }
    }

    #[test]
    fn plain_text_is_not_said_to_be_a_number_that_is_not_finite() {
        for text in
            ["hello there", "", "{\"hand\":\"right\"", "this line is infinite", "[[0.1,,0.2]]"]
        {
            let mut reader = JointsReader::new(HandDimensions::default(), None);
            for i in 0..60 {
                reader.feed(format!("{text}\n{{\n").as_bytes(), false, f64::from(i) / 30.0);
            }
            let said = reader.doubt().unwrap_or_else(|| panic!("{text}: nothing was said"));
            assert!(said.contains("no records of joints"), "{text}: {said}");
            assert!(!said.contains("not finite"), "{text}: {said}");
        }
    }

    #[test]
    fn lines_that_are_no_records_are_told_by_their_fault() {
        let mut doubts = Doubts::default();
        (0..100).for_each(|_| doubts.fault(&JointsFaultKind::JointCount { got: 21 }));
        let said = doubts.sentence().unwrap();
        doubts.fault(&JointsFaultKind::JointCount { got: 20 });
        assert_eq!(doubts.sentence().as_ref(), Some(&said));
        assert!(said.contains("21 joints") && said.contains("metacarpals"), "{said}");
    }
}
