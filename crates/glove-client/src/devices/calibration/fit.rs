//! Fits offset and gain of every sensor to two held gestures.

use softgrasp_core::hand::JointAngles;

use super::linear::{Calibration, SensorCalibration, sensor_angle};
use crate::devices::cyberglove::{RawSensors, Sensor, SensorSet, is_rail};

/// What a fit could say about one sensor.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SensorFit {
    /// Offset and gain are new.
    Full,
    /// The gestures hardly differ at this joint: the offset is new, the gain was kept.
    OffsetOnly,
    /// The gestures differ but the readings do not: the offset is new, the gain was kept.
    Unmoved,
    /// Stuck at an end of its range in every reading: marked dead, the line was kept.
    Dead,
    /// No reading of this sensor: the line was kept.
    Absent,
}

/// A fitted calibration and how each sensor came out.
#[derive(Clone, Debug, PartialEq)]
pub struct FitReport {
    /// The calibration.
    pub calibration: Calibration,
    /// One outcome per sensor, in the order of [`Sensor::ALL`].
    pub outcomes: [SensorFit; 22],
}

impl FitReport {
    /// The sensors with this outcome.
    pub fn with_outcome(&self, outcome: SensorFit) -> SensorSet {
        Sensor::ALL.into_iter().filter(|s| self.outcomes[s.index()] == outcome).collect()
    }
}

/// Gestures must differ by this much at a joint before a gain is fitted, rad.
const MIN_ANGLE: f64 = 0.15;
/// And the mean readings by this much, counts.
const MIN_COUNTS: f64 = 4.0;

/// Fits a straight line per sensor through two gestures held for a few readings each.
///
/// Shapes: any number of readings per gesture, averaged. `start` supplies what the gestures do
/// not determine. Units: rad. Abductions are fitted as the spreads the sensors feel.
pub fn fit_two_gestures(
    start: &Calibration,
    flat: (&JointAngles, &[RawSensors]),
    fist: (&JointAngles, &[RawSensors]),
) -> FitReport {
    let mut calibration = start.clone();
    let mut outcomes = [SensorFit::Absent; 22];
    for sensor in Sensor::ALL {
        let angles = [flat.0, fist.0].map(|gesture| sensor_angle(gesture, sensor));
        let readings = [flat.1, fist.1].map(|readings| values(readings, sensor));
        let line = start.sensor(sensor);
        let (fitted, outcome) = fit_line(line, angles, readings);
        calibration.sensors[sensor.index()] = fitted;
        outcomes[sensor.index()] = outcome;
    }
    FitReport { calibration, outcomes }
}

fn values(readings: &[RawSensors], sensor: Sensor) -> Vec<u8> {
    readings.iter().filter_map(|raw| raw.get(sensor)).collect()
}

fn mean(values: &[u8]) -> f64 {
    values.iter().map(|&v| f64::from(v)).sum::<f64>() / values.len() as f64
}

fn fit_line(
    start: &SensorCalibration,
    angles: [f64; 2],
    readings: [Vec<u8>; 2],
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
    if count_change.abs() < MIN_COUNTS {
        return kept_gain(SensorFit::Unmoved);
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
}
