//! Dimensions of one person's hand, measured in records of its joints.

use nalgebra::{Point3, UnitQuaternion, Vector3};
use softgrasp_grasp::hand::{Finger, HandDimensions};

use super::bones::{HandSize, MeasuredBones, SizeError};
use super::fit::HandFit;
use super::places::{mirrored, wrist_in_palm};
use super::record::{JointsRecord, WRIST, digit_joints};

/// Records that are fitted to find the knuckles, spread over all that are given.
const RECORDS_MAX: usize = 60;
/// Times that they are fitted, each with the knuckles of the time before.
const ROUNDS: usize = 4;
/// A bone may be shorter or longer than that of a hand of this size by these shares; beyond them it
/// is the tracker's fault.
const BONE_SHARES: [f64; 2] = [0.6, 1.6];
/// A knuckle may be this far from where a hand of this size has it, m.
const KNUCKLE_OFF_M: f64 = 0.025;
/// The last bone is at least so many times as long as the fingertip's radius.
const TIP_RADII: f64 = 1.05;

/// Dimensions of the hand in these records: its size, its bones, its knuckles.
///
/// The hand is that of `HandDimensions::scaled` for the size of `hand_size`.
/// Then bones get the measured lengths, and knuckles and thumb's base the places where the records
/// have them while the palm is fitted. Radii, the directions of the fingers in the flat hand and
/// the thumb's roll stay those of the size. Left or right as the records say.
///
/// # Errors
/// [`SizeError`] when hardly any bone is tracked, the hand is not of a human size, or the records
/// are of both hands.
pub fn fitted_dimensions(records: &[JointsRecord]) -> Result<HandDimensions, SizeError> {
    let bones = MeasuredBones::new(records);
    let HandSize { length_m, breadth_m } = bones.size()?;
    let handedness = records.first().map_or_else(Default::default, |record| record.hand);
    if records.iter().any(|record| record.hand != handedness) {
        return Err(SizeError::BothHands);
    }
    let usual = HandDimensions::scaled(length_m, breadth_m)?.with_handedness(handedness);
    let mut hand = usual;
    set_bones(&mut hand, &bones);
    let every = records.len().div_ceil(RECORDS_MAX).max(1);
    let some: Vec<JointsRecord> = records.iter().step_by(every).copied().collect();
    for _ in 0..ROUNDS {
        let knuckles = measured_knuckles(&hand, &some);
        set_knuckles(&mut hand, &usual, &knuckles);
    }
    Ok(hand)
}

fn set_bones(hand: &mut HandDimensions, bones: &MeasuredBones) {
    let tip_radii = hand.tip_radii();
    let thumb = &mut hand.thumb.lengths;
    let all = std::iter::once(thumb).chain(hand.fingers.iter_mut().map(|f| &mut f.lengths));
    for ((lengths, measured), tip_radius) in all.zip(&bones.lengths).zip(tip_radii) {
        for (length, measured) in lengths.iter_mut().zip(measured) {
            let [least, most] = BONE_SHARES.map(|share| share * *length);
            if let Some(measured) = measured {
                *length = measured.clamp(least, most);
            }
        }
        lengths[2] = lengths[2].max(TIP_RADII * tip_radius);
    }
}

/// Mean places in the palm frame of a right hand: thumb's base, then the four knuckles with a flat
/// palm; `None` for what no record has.
fn measured_knuckles(hand: &HandDimensions, records: &[JointsRecord]) -> [Option<Point3<f64>>; 5] {
    let mut sums = [(Vector3::zeros(), 0); 5];
    let mut fit = HandFit::new(*hand);
    for record in records {
        let Ok(fitted) = fit.fit(record) else { continue };
        let in_palm = |joint: usize| {
            let seen = record.position(joint)?;
            let in_palm = fitted.world_from_palm.inverse_transform_point(&seen);
            Some(mirrored(hand.handedness, in_palm))
        };
        // The wrist is where the palm begins: seen elsewhere, it moves all knuckles with it.
        let wrist = wrist_in_palm(hand);
        let shift = in_palm(WRIST).map_or_else(Vector3::zeros, |seen| wrist - seen);
        for (finger, (sum, count)) in Finger::ALL.into_iter().zip(&mut sums) {
            let Some(seen) = in_palm(digit_joints(finger)[0]) else { continue };
            let share = match finger {
                Finger::Thumb => 0.0,
                _ => hand.fingers[finger.index() - 1].arch_share,
            };
            let arch = share * fitted.angles.palm_arch;
            let flat = UnitQuaternion::from_axis_angle(&Vector3::y_axis(), -arch);
            *sum += flat * (seen + shift).coords;
            *count += 1;
        }
    }
    sums.map(|(sum, count)| (count > 0).then(|| Point3::from(sum / f64::from(count))))
}

fn set_knuckles(
    hand: &mut HandDimensions,
    usual: &HandDimensions,
    measured: &[Option<Point3<f64>>; 5],
) {
    let near = |usual: Point3<f64>, measured: Option<Point3<f64>>| {
        let off = measured.map_or_else(Vector3::zeros, |measured| measured - usual);
        usual + off.cap_magnitude(KNUCKLE_OFF_M)
    };
    let [thumb, fingers @ ..] = measured;
    for ((finger, usual), measured) in hand.fingers.iter_mut().zip(&usual.fingers).zip(fingers) {
        finger.mcp_in_palm = near(usual.mcp_in_palm, *measured);
    }
    hand.thumb.tmj_in_palm = near(usual.thumb.tmj_in_palm, *thumb);
    // The flat thumb keeps its direction in the palm, though its line to the index knuckle turns.
    let line = |hand: &HandDimensions| {
        let way = hand.fingers[0].mcp_in_palm - hand.thumb.tmj_in_palm;
        (-way.x).atan2(way.y)
    };
    hand.thumb.fan = usual.thumb.fan + line(usual) - line(hand);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::joints::places::record_of_hand;
    use nalgebra::Isometry3;
    use proptest::prelude::*;
    use softgrasp_grasp::hand::{Handedness, JointAngles};

    /// A hand that opens and closes while it turns.
    fn records_of(hand: &HandDimensions) -> Vec<JointsRecord> {
        let record = |i: usize| {
            let closed = 0.5 - 0.5 * (0.2 * i as f64).cos();
            let mut angles = JointAngles::flat().lerp(&JointAngles::fist(), closed);
            angles.palm_arch = 0.0;
            let turn = Vector3::new(0.02 * i as f64, -0.3, 0.2);
            record_of_hand(hand, &angles, &Isometry3::new(Vector3::new(0.1, 0.2, 0.0), turn))
        };
        (0..40).map(record).collect()
    }

    fn mean_rms(hand: HandDimensions, records: &[JointsRecord]) -> f64 {
        let mut fit = HandFit::new(hand);
        let sum: f64 = records.iter().map(|r| fit.fit(r).unwrap().fit_error_rms_m).sum();
        sum / records.len() as f64
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(24))]

        #[test]
        fn a_hand_of_other_bones_and_knuckles_is_fitted_much_better_with_its_own_dimensions(
            shares in prop::collection::vec(0.85..1.15f64, 15),
            knuckles in prop::collection::vec(prop::array::uniform3(-6e-3..6e-3f64), 5),
            length in 0.16..0.2f64, left in any::<bool>(),
        ) {
            let side = if left { Handedness::Left } else { Handedness::Right };
            let mut hand = HandDimensions::scaled(length, 0.45 * length).unwrap();
            hand.handedness = side;
            let usual = hand;
            let thumb = &mut hand.thumb.lengths;
            let all = std::iter::once(thumb).chain(hand.fingers.iter_mut().map(|f| &mut f.lengths));
            for (length, share) in all.flatten().zip(shares) {
                *length *= share;
            }
            hand.thumb.tmj_in_palm += Vector3::from(knuckles[0]);
            for (finger, off) in hand.fingers.iter_mut().zip(&knuckles[1..]) {
                finger.mcp_in_palm += Vector3::from(*off);
            }
            let records = records_of(&hand);
            let own = fitted_dimensions(&records).unwrap();
            prop_assert_eq!(own.handedness, side);
            let (before, after) = (mean_rms(usual, &records), mean_rms(own, &records));
            prop_assert!(after < 1.5e-3 && after < 0.5 * before, "{before} m to {after} m");
        }
    }

    #[test]
    fn a_hand_of_the_table_keeps_its_dimensions() {
        let hand = HandDimensions::scaled(0.172, 0.079).unwrap();
        let own = fitted_dimensions(&records_of(&hand)).unwrap();
        assert!((own.hand_length - 0.172).abs() < 1e-6 && (own.hand_breadth - 0.079).abs() < 1e-6);
        for (own, hand) in own.fingers.iter().zip(&hand.fingers) {
            assert!((own.mcp_in_palm - hand.mcp_in_palm).norm() < 1e-4);
            assert!(own.lengths.iter().zip(&hand.lengths).all(|(a, b)| (a - b).abs() < 1e-9));
        }
        assert!((own.thumb.fan - hand.thumb.fan).abs() < 1e-2);
    }

    #[test]
    fn records_that_say_nothing_are_errors() {
        assert!(matches!(fitted_dimensions(&[]), Err(SizeError::NotEnoughBones { measured: 0 })));
        let hand = HandDimensions::default();
        let record = record_of_hand(&hand, &JointAngles::flat(), &Isometry3::identity());
        let left = JointsRecord { hand: Handedness::Left, ..record };
        assert_eq!(fitted_dimensions(&[record, left]), Err(SizeError::BothHands));
        let mut giant = record;
        for joint in giant.joints.iter_mut().flatten() {
            joint.position *= 4.0;
        }
        assert!(matches!(fitted_dimensions(&[giant]), Err(SizeError::Dimensions(_))));
        let mut speck = record;
        for joint in speck.joints.iter_mut().flatten() {
            joint.position *= 0.0;
        }
        assert!(matches!(fitted_dimensions(&[speck]), Err(SizeError::Dimensions(_))));
    }
}
