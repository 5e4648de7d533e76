//! Fits offset and gain of every sensor to two held gestures.

use softgrasp_grasp::hand::JointAngles;

use super::fit_quality::{Complaint, SensorQuality, mean};
use super::linear::{Calibration, SensorCalibration, sensor_angle};
use super::thumb::{THUMB_ROOT, ThumbCoupling};
use super::thumb_fit::{ThumbFit, ThumbRoot, fit_thumb};
use crate::devices::cyberglove::{RawSensors, Sensor, SensorSet, is_rail};

/// Outcome of a fit for one sensor.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SensorFit {
    /// Offset and gain are new.
    Full,
    /// The gestures hardly differ at this joint: the offset is new, the gain was kept.
    OffsetOnly,
    /// The gestures differ but the readings hardly do: the offset is new, the gain was kept.
    Unmoved,
    /// A bending joint whose reading went the wrong way: the line was kept.
    Reversed,
    /// Stuck at an end of its range in every reading: marked dead, the line was kept.
    Dead,
    /// No reading of this sensor: the line was kept.
    Absent,
}

/// A fitted calibration and how each sensor came out.
#[derive(Clone, Debug, PartialEq)]
pub struct FitReport {
    /// The fitted calibration.
    pub calibration: Calibration,
    /// One outcome per sensor, in the order of [`Sensor::ALL`].
    pub outcomes: [SensorFit; 22],
    /// How well the gestures could be told apart by each sensor, in the same order.
    pub qualities: [SensorQuality; 22],
    /// Outcome of the fit for the coupling of the thumb's two sensors.
    pub thumb: ThumbFit,
}

impl FitReport {
    /// The sensors with this outcome.
    pub fn with_outcome(&self, outcome: SensorFit) -> SensorSet {
        Sensor::ALL.into_iter().filter(|s| self.outcomes[s.index()] == outcome).collect()
    }

    /// What a person should do better, one sentence each; empty for good gestures.
    pub fn complaints(&self) -> Vec<Complaint> {
        let mut found = Vec::new();
        for sensor in Sensor::ALL {
            let outcome = self.outcomes[sensor.index()];
            if matches!(outcome, SensorFit::Dead | SensorFit::Absent) {
                continue;
            }
            found.extend(self.qualities[sensor.index()].complaint(sensor));
        }
        if self.thumb == ThumbFit::TooAlike {
            found.push(Complaint::ThumbTooAlike);
        }
        found
    }

    /// Why the fit is no calibration: the hand would open when it closes, or hardly move. `None` for
    /// one that may be used, whatever its complaints are.
    pub fn refusal(&self) -> Option<FitRefusal> {
        let count =
            |outcome| KNUCKLES.into_iter().filter(|s| self.outcomes[s.index()] == outcome).count();
        let (moved, reversed) = (count(SensorFit::Full), count(SensorFit::Reversed));
        match (moved, reversed) {
            (_, REVERSED_MAX..) => Some(FitRefusal::Reversed { reversed }),
            (..MOVED_MIN, _) => Some(FitRefusal::Unmoved { moved }),
            _ => None,
        }
    }
}

/// Why a fit is no calibration.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum FitRefusal {
    /// The readings of fingers that bent went the wrong way.
    #[error(
        "{reversed} of the 8 sensors of the fingers' MPJ and PIJ went the wrong way: the flat hand \
         and the fist were shown in the wrong order"
    )]
    Reversed {
        /// Number of these sensors that went the wrong way.
        reversed: usize,
    },
    /// Too few fingers moved.
    #[error(
        "only {moved} of the 8 sensors of the fingers' MPJ and PIJ moved as a fist moves them: show \
         the flat hand, then a tight fist"
    )]
    Unmoved {
        /// Number of these sensors that moved as a fist moves them.
        moved: usize,
    },
}

/// The sensors that every fist moves.
const KNUCKLES: [Sensor; 8] = [
    Sensor::IndexMcp,
    Sensor::IndexPip,
    Sensor::MiddleMcp,
    Sensor::MiddlePip,
    Sensor::RingMcp,
    Sensor::RingPip,
    Sensor::LittleMcp,
    Sensor::LittlePip,
];
/// Fewest of these sensors that must have moved: a glove may have dead sensors.
const MOVED_MIN: usize = 5;
/// Number of these sensors with a reversed reading from which on the fit is refused: so many are no fault
/// of the sensors.
const REVERSED_MAX: usize = 3;

/// A gesture that is held: the joint angles it is believed to have, and what the glove read.
#[derive(Clone, Copy, Debug)]
pub struct Gesture<'a> {
    /// Joint angles that the hand is believed to have, rad.
    pub angles: &'a JointAngles,
    /// Readings of the glove while the gesture is held, any number; they are averaged.
    pub readings: &'a [RawSensors],
}

/// Gestures must differ by this much at a joint before a gain is fitted, rad.
const MIN_ANGLE: f64 = 0.15;
/// Mean readings of both gestures must differ by this much before a gain is fitted, counts.
const MIN_COUNTS: f64 = 4.0;

/// The third gesture, for the thumb: a flat hand whose straight thumb is swung in front of the
/// palm and held away from it, as around a jar.
///
/// The two angles of the thumb's root are this project's estimate. They differ from those of the
/// fist in their proportion, which is what tells the thumb's two sensors apart.
pub const fn thumb_across() -> JointAngles {
    let mut angles = JointAngles::flat();
    angles.thumb.rotation = 1.05;
    angles.thumb.abduction = 0.26;
    angles
}

/// Fits a straight line per sensor through two gestures held for a few readings each.
///
/// See [`fit_gestures`].
pub fn fit_two_gestures(
    start: &Calibration,
    flat: (&JointAngles, &[RawSensors]),
    fist: (&JointAngles, &[RawSensors]),
) -> FitReport {
    let [flat, fist] = [flat, fist].map(|(angles, readings)| Gesture { angles, readings });
    fit_gestures(start, flat, fist, None)
}

/// Fits a straight line per sensor through two gestures, and the thumb's coupling through a third.
///
/// Shapes: any number of readings per gesture, averaged. `start` supplies what the gestures do
/// not determine. Units: rad. Abductions are fitted as the spreads the sensors feel. Without a
/// third gesture the thumb is not coupled; where the third one is too like the fist the thumb keeps
/// the two lines of the first two.
pub fn fit_gestures(
    start: &Calibration,
    flat: Gesture<'_>,
    fist: Gesture<'_>,
    thumb: Option<Gesture<'_>>,
) -> FitReport {
    let mut calibration = start.clone();
    let mut outcomes = [SensorFit::Absent; 22];
    let mut qualities = [SensorQuality::default(); 22];
    for sensor in Sensor::ALL {
        let angles = [flat, fist].map(|gesture| sensor_angle(gesture.angles, sensor));
        let readings = [flat, fist].map(|gesture| values(gesture.readings, sensor));
        let line = start.sensor(sensor);
        qualities[sensor.index()] = SensorQuality::of(&readings, expected(line, angles));
        let (fitted, outcome) = fit_line(line, angles, readings, &qualities[sensor.index()]);
        calibration.sensors[sensor.index()] = fitted;
        outcomes[sensor.index()] = outcome;
    }
    calibration.thumb_coupling = ThumbCoupling::default();
    let thumb = thumb.map_or(ThumbFit::NotShown, |thumb| {
        fit_thumb(&mut calibration, &[flat, fist, thumb].map(|gesture| thumb_root(&gesture)))
    });
    FitReport { calibration, outcomes, qualities, thumb }
}

/// Counts by which a sensor should move between two angles, by the line to start from; `None`
/// where the gestures hardly differ.
fn expected(line: &SensorCalibration, angles: [f64; 2]) -> Option<f64> {
    let change = angles[1] - angles[0];
    (change.abs() >= MIN_ANGLE).then_some(change / line.gain_rad_per_count)
}

/// Angles and mean readings of the thumb's two sensors; `None` without readings.
fn thumb_root(gesture: &Gesture<'_>) -> ThumbRoot {
    ThumbRoot {
        angles: THUMB_ROOT.map(|sensor| sensor_angle(gesture.angles, sensor)),
        counts: THUMB_ROOT.map(|sensor| {
            let values = values(gesture.readings, sensor);
            (!values.is_empty()).then(|| mean(&values))
        }),
    }
}

fn values(readings: &[RawSensors], sensor: Sensor) -> Vec<u8> {
    readings.iter().filter_map(|raw| raw.get(sensor)).collect()
}

fn fit_line(
    start: &SensorCalibration,
    angles: [f64; 2],
    readings: [Vec<u8>; 2],
    quality: &SensorQuality,
) -> (SensorCalibration, SensorFit) {
    let [flat, fist] = &readings;
    let (Some(&first), false) = (flat.first(), fist.is_empty()) else {
        return (*start, SensorFit::Absent);
    };
    if is_rail(first) && flat.iter().chain(fist).all(|&v| v == first) {
        return (SensorCalibration { dead: true, ..*start }, SensorFit::Dead);
    }
    let counts = [mean(flat), mean(fist)];
    let (angle_change, count_change) = (angles[1] - angles[0], counts[1] - counts[0]);
    let kept_gain = |outcome| {
        // Both gestures count alike when the gain is given.
        let gain = start.gain_rad_per_count;
        let offset_counts = match outcome {
            SensorFit::Unmoved => counts[0] - angles[0] / gain,
            _ => 0.5 * (counts[0] + counts[1] - (angles[0] + angles[1]) / gain),
        };
        (SensorCalibration { offset_counts, dead: false, ..*start }, outcome)
    };
    if angle_change.abs() < MIN_ANGLE {
        return kept_gain(SensorFit::OffsetOnly);
    }
    // A line through readings that are nearly the same would be steep and its sign that of the noise.
    if count_change.abs() < MIN_COUNTS || quality.is_small() {
        return kept_gain(SensorFit::Unmoved);
    }
    if quality.is_reversed(start.sensor) {
        return (SensorCalibration { dead: false, ..*start }, SensorFit::Reversed);
    }
    let gain_rad_per_count = angle_change / count_change;
    let offset_counts = counts[0] - angles[0] / gain_rad_per_count;
    let fitted = SensorCalibration { offset_counts, gain_rad_per_count, dead: false, ..*start };
    (fitted, SensorFit::Full)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::devices::cyberglove::SensorCount;
    use proptest::prelude::*;

    /// A glove that differs from the default one in every line.
    fn other_glove(offsets: &[f64; 22], gains: &[f64; 22]) -> Calibration {
        let mut glove = Calibration::default();
        for sensor in Sensor::ALL {
            let line = &mut glove.sensors[sensor.index()];
            line.offset_counts += offsets[sensor.index()];
            line.gain_rad_per_count *= gains[sensor.index()];
        }
        glove
    }

    fn fit(glove: &Calibration, count: SensorCount) -> FitReport {
        let (flat, fist) = (JointAngles::flat(), JointAngles::fist());
        let readings = |gesture| vec![glove.raw_from_angles(gesture, count); 3];
        let start = Calibration::default();
        fit_two_gestures(&start, (&flat, &readings(&flat)), (&fist, &readings(&fist)))
    }

    proptest! {
        #[test]
        fn two_gestures_recover_an_unknown_glove(
            offsets in prop::array::uniform22(-15.0..15.0f64),
            gains in prop::array::uniform22(0.9..1.2f64),
        ) {
            let glove = other_glove(&offsets, &gains);
            let report = fit(&glove, SensorCount::TwentyTwo);
            for sensor in report.with_outcome(SensorFit::Full).iter() {
                let (found, truth) = (report.calibration.sensor(sensor), glove.sensor(sensor));
                // Both ends are rounded to counts, so the gesture comes back within one gain.
                for gesture in [JointAngles::flat(), JointAngles::fist()] {
                    let angle = sensor_angle(&gesture, sensor);
                    let raw = truth.offset_counts + angle / truth.gain_rad_per_count;
                    let back = (raw - found.offset_counts) * found.gain_rad_per_count;
                    prop_assert!((back - angle).abs() <= 1.3 * truth.gain_rad_per_count.abs());
                }
            }
        }
    }

    #[test]
    fn flexions_are_fitted_fully_and_spreads_by_offset() {
        let report = fit(&Calibration::default(), SensorCount::TwentyTwo);
        assert_eq!(report.with_outcome(SensorFit::Full).iter().count(), 17);
        let offset_only: Vec<_> = report.with_outcome(SensorFit::OffsetOnly).iter().collect();
        let expected = [
            Sensor::MiddleIndexAbduction,
            Sensor::RingMiddleAbduction,
            Sensor::LittleRingAbduction,
            Sensor::WristPitch,
            Sensor::WristYaw,
        ];
        assert_eq!(offset_only, expected);
    }

    #[test]
    fn stuck_and_unmoved_sensors_are_told_apart_and_held_at_rest() {
        let (flat, fist) = (JointAngles::flat(), JointAngles::fist());
        let start = Calibration::default();
        let broken = |gesture| {
            let raw = start.raw_from_angles(gesture, SensorCount::TwentyTwo);
            [RawSensors::from_fn(SensorCount::TwentyTwo, |sensor| match sensor {
                Sensor::PalmArch => 254,
                Sensor::ThumbRotation => 1,
                Sensor::RingMcp => 77,
                _ => raw.get(sensor).unwrap(),
            })]
        };
        let report = fit_two_gestures(&start, (&flat, &broken(&flat)), (&fist, &broken(&fist)));
        let dead: Vec<_> = report.with_outcome(SensorFit::Dead).iter().collect();
        assert_eq!(dead, [Sensor::ThumbRotation, Sensor::PalmArch]);
        let unmoved: Vec<_> = report.with_outcome(SensorFit::Unmoved).iter().collect();
        assert_eq!(unmoved, [Sensor::RingMcp]);
        assert_eq!(report.calibration.dead().iter().collect::<Vec<_>>(), dead);
        let angles = report.calibration.angles(&broken(&fist)[0], SensorSet::EMPTY);
        assert_eq!((angles.palm_arch, angles.thumb.rotation), (0.0, 0.0));
        assert_eq!(angles.ring.mcp_flexion, 0.0, "its offset is its reading");
    }

    #[test]
    fn sensors_without_readings_keep_their_line() {
        let report = fit(&Calibration::default(), SensorCount::Eighteen);
        assert_eq!(report.with_outcome(SensorFit::Absent).iter().count(), 4);
        let flat = JointAngles::flat();
        let start = Calibration::default();
        let nothing = fit_two_gestures(&start, (&flat, &[]), (&flat, &[]));
        assert_eq!(nothing.calibration, start);
    }

    fn moved(changes: &[(Sensor, u8)], gesture: &JointAngles) -> Vec<RawSensors> {
        let raw = Calibration::default().raw_from_angles(gesture, SensorCount::TwentyTwo);
        let change = |sensor| changes.iter().find(|c| c.0 == sensor).map(|c| c.1);
        let reading = RawSensors::from_fn(SensorCount::TwentyTwo, |sensor| {
            change(sensor).unwrap_or(raw.get(sensor).unwrap())
        });
        vec![reading; 20]
    }

    fn told(report: &FitReport) -> Vec<String> {
        report.complaints().iter().map(ToString::to_string).collect()
    }

    #[test]
    fn good_gestures_draw_no_complaint_and_poor_ones_a_sentence() {
        let (flat, fist) = (JointAngles::flat(), JointAngles::fist());
        let start = Calibration::default();
        let good =
            fit_two_gestures(&start, (&flat, &moved(&[], &flat)), (&fist, &moved(&[], &fist)));
        assert_eq!(told(&good), [""; 0]);
        let loose = moved(&[(Sensor::IndexMcp, 63)], &fist);
        let report = fit_two_gestures(&start, (&flat, &moved(&[], &flat)), (&fist, &loose));
        assert_eq!(
            told(&report),
            ["index MPJ moved by 3 counts only; hold a tighter fist and try again"]
        );
        let swapped =
            fit_two_gestures(&start, (&flat, &moved(&[], &fist)), (&fist, &moved(&[], &flat)));
        let sentence = "index PIJ fell where it should rise; show the flat hand first and then the \
                        fist, and try again";
        assert!(told(&swapped).contains(&sentence.to_owned()), "{:?}", told(&swapped));
        assert_eq!(swapped.refusal(), Some(FitRefusal::Reversed { reversed: 8 }));
        assert_eq!((good.refusal(), report.refusal()), (None, None));
        let mut shaking = moved(&[], &fist);
        for (i, reading) in shaking.iter_mut().enumerate() {
            let sway = if i % 2 == 0 { 10 } else { 0 };
            let held = *reading;
            *reading = RawSensors::from_fn(SensorCount::TwentyTwo, |sensor| {
                let sways = sensor == Sensor::RingPip;
                held.get(sensor).unwrap() - if sways { sway } else { 0 }
            });
        }
        let report = fit_two_gestures(&start, (&flat, &moved(&[], &flat)), (&fist, &shaking));
        assert_eq!(
            told(&report),
            ["ring PIJ trembled by 5 counts; hold each gesture still and try again"]
        );
        assert_eq!(report.qualities[Sensor::RingPip.index()].noise_counts, 5.0);
    }

    #[test]
    fn sensor_that_went_the_wrong_way_or_hardly_moved_never_gets_a_gain_of_the_wrong_sign() {
        let (flat, fist) = (JointAngles::flat(), JointAngles::fist());
        let start = Calibration::default();
        // The palm arch fell by many counts, the little finger's MPJ by a few.
        let readings = moved(&[(Sensor::PalmArch, 20), (Sensor::LittleMcp, 55)], &fist);
        let report = fit_two_gestures(&start, (&flat, &moved(&[], &flat)), (&fist, &readings));
        for (sensor, outcome) in
            [(Sensor::PalmArch, SensorFit::Reversed), (Sensor::LittleMcp, SensorFit::Unmoved)]
        {
            assert_eq!(report.outcomes[sensor.index()], outcome);
            let gains = [&report.calibration, &start].map(|c| c.sensor(sensor).gain_rad_per_count);
            assert_eq!(gains[0], gains[1], "{sensor:?}");
        }
        assert_eq!(report.refusal(), None, "the other fingers are good");
        let nothing =
            fit_two_gestures(&start, (&flat, &moved(&[], &flat)), (&fist, &moved(&[], &flat)));
        assert_eq!(nothing.refusal(), Some(FitRefusal::Unmoved { moved: 0 }));
    }

    #[test]
    fn third_gesture_recovers_the_coupling_of_the_thumb() {
        let coupling = ThumbCoupling {
            rotation_rad_per_abduction_count: 0.0015,
            abduction_rad_per_rotation_count: -0.0012,
        };
        let glove = Calibration { thumb_coupling: coupling, ..Calibration::default() };
        let gestures = [JointAngles::flat(), JointAngles::fist(), thumb_across()];
        let readings = gestures.map(|g| vec![glove.raw_from_angles(&g, SensorCount::Eighteen); 9]);
        let held = |i: usize| Gesture { angles: &gestures[i], readings: &readings[i] };
        let start = Calibration::default();
        let report = fit_gestures(&start, held(0), held(1), Some(held(2)));
        assert_eq!(report.thumb, ThumbFit::Coupled);
        let found = report.calibration.thumb_coupling;
        // Counts are rounded: half a count in some 50 is a percent of the gains.
        let off = found.terms()[0] - coupling.terms()[0];
        assert!(off.abs() < 5e-4, "{found:?}");
        assert!((found.terms()[1] - coupling.terms()[1]).abs() < 3e-4, "{found:?}");
        for (gesture, readings) in gestures.iter().zip(&readings) {
            let thumb = report.calibration.angles(&readings[0], SensorSet::EMPTY).thumb;
            assert!((thumb.rotation - gesture.thumb.rotation).abs() < 1e-9);
            assert!((thumb.abduction - gesture.thumb.abduction).abs() < 1e-9);
        }
        let alike = fit_gestures(&start, held(0), held(1), Some(held(1)));
        assert_eq!(alike.thumb, ThumbFit::TooAlike);
        assert!(alike.calibration.thumb_coupling.is_none());
        assert!(told(&alike)[0].starts_with("the thumb stood as in the fist"));
    }
}
