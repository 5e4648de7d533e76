//! Bone lengths and size of a hand, measured in records of its joints.

use nalgebra::Point3;
use softgrasp_grasp::hand::{DimensionsError, Finger, HandDimensions};

use super::record::{JointsRecord, digit_joints};

/// Bones that must be measured before a size is believed.
const BONES_NEEDED: usize = 3;

/// Why records say nothing about the size of the hand.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum SizeError {
    /// Hardly any bone has both its ends tracked.
    #[error("{measured} finger bones are tracked; {BONES_NEEDED} are needed")]
    NotEnoughBones {
        /// Finger bones that were measured.
        measured: usize,
    },
    /// The hand is not of a human size.
    #[error("the tracked hand is not of a human size")]
    Dimensions(#[from] DimensionsError),
    /// The records are of both hands.
    #[error("the records are of both hands")]
    BothHands,
}

/// Length and breadth of a hand, as `HandDimensions::scaled` takes them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HandSize {
    /// Wrist crease to the tip of the middle finger, m.
    pub length_m: f64,
    /// Breadth across the knuckles, m.
    pub breadth_m: f64,
}

/// Medians over records of what does not change as the hand moves.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct MeasuredBones {
    /// Bones of each digit as [`HandDimensions::segment_lengths`] has them, m.
    pub(super) lengths: [[Option<f64>; 3]; 5],
    /// Distance between the knuckles of index and little finger, m.
    pub(super) across_knuckles: Option<f64>,
}

impl MeasuredBones {
    pub(super) fn new(records: &[JointsRecord]) -> Self {
        let between = |from: usize, to: usize| {
            let distance = |record: &JointsRecord| distance(record, from, to);
            median(records.iter().filter_map(distance).collect())
        };
        let lengths = Finger::ALL.map(|finger| {
            let joints = digit_joints(finger);
            [0, 1, 2].map(|bone| between(joints[bone], joints[bone + 1]))
        });
        let [index, little] = [Finger::Index, Finger::Little].map(|f| digit_joints(f)[0]);
        Self { lengths, across_knuckles: between(index, little) }
    }

    /// The size of the hand whose bones these are.
    ///
    /// The length is in proportion to the measured finger bones together; the breadth follows from
    /// the outer knuckles, or where these are not tracked from the length.
    pub(super) fn size(&self) -> Result<HandSize, SizeError> {
        let usual = HandDimensions::default();
        let (mut measured, mut expected, mut count) = (0.0, 0.0, 0);
        for (lengths, usual) in self.lengths.iter().zip(usual.segment_lengths()).skip(1) {
            for (length, usual) in lengths.iter().zip(usual) {
                let Some(length) = length else { continue };
                measured += length;
                expected += usual;
                count += 1;
            }
        }
        if count < BONES_NEEDED {
            return Err(SizeError::NotEnoughBones { measured: count });
        }
        let length_m = usual.hand_length * measured / expected;
        let scale = length_m / usual.hand_length;
        let breadth_m = self.across_knuckles.map_or(usual.hand_breadth * scale, |across| {
            let way = usual.fingers[3].mcp_in_palm - usual.fingers[0].mcp_in_palm;
            let along = way.y * scale;
            let sideways = (across * across - along * along).max(0.0).sqrt();
            usual.hand_breadth * sideways / way.x
        });
        Ok(HandSize { length_m, breadth_m })
    }
}

/// Length and breadth of the hand in these records.
///
/// Units: m. Joints that are not tracked are left out; each bone counts by its median.
///
/// # Errors
/// [`SizeError`] when hardly any bone is tracked.
pub fn hand_size(records: &[JointsRecord]) -> Result<HandSize, SizeError> {
    MeasuredBones::new(records).size()
}

fn distance(record: &JointsRecord, from: usize, to: usize) -> Option<f64> {
    let (from, to): (Point3<f64>, Point3<f64>) = (record.position(from)?, record.position(to)?);
    Some((to - from).norm())
}

/// Median of the values; `None` for an empty list.
fn median(mut values: Vec<f64>) -> Option<f64> {
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::joints::places::record_of_hand;
    use nalgebra::Isometry3;
    use proptest::prelude::*;
    use softgrasp_grasp::hand::JointAngles;

    proptest! {
        #[test]
        fn the_size_of_a_known_hand_comes_back(
            length in 0.14..0.22f64, share in 0.42..0.5f64, closed in 0.0..1.0f64,
        ) {
            let hand = HandDimensions::scaled(length, share * length).unwrap();
            let mut angles = JointAngles::flat().lerp(&JointAngles::fist(), closed);
            angles.palm_arch = 0.0;
            let record = record_of_hand(&hand, &angles, &Isometry3::translation(0.1, 0.2, 0.3));
            let size = hand_size(&[record]).unwrap();
            prop_assert!((size.length_m - length).abs() < 1e-9);
            prop_assert!((size.breadth_m - share * length).abs() < 1e-9);
        }
    }

    #[test]
    fn a_few_records_with_an_outlier_and_lost_joints_suffice() {
        let hand = HandDimensions::default();
        let whole = record_of_hand(&hand, &JointAngles::flat(), &Isometry3::identity());
        let mut wild = whole;
        for joint in wild.joints.iter_mut().flatten() {
            joint.position *= 3.0;
        }
        let mut records = vec![whole, wild, whole];
        assert!((hand_size(&records).unwrap().length_m - 0.185).abs() < 1e-9);
        for record in &mut records {
            record.joints[22] = None;
            record.joints[25] = None;
        }
        let size = hand_size(&records).unwrap();
        assert!((size.length_m - 0.185).abs() < 1e-9 && (size.breadth_m - 0.084).abs() < 1e-9);
        for record in &mut records {
            record.joints[6..].fill(None);
        }
        assert_eq!(hand_size(&records), Err(SizeError::NotEnoughBones { measured: 0 }));
        assert!(hand_size(&[]).is_err());
    }
}
