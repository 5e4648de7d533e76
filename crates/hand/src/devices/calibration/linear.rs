//! The calibration itself: raw counts → joint angles and back.

use serde::{Deserialize, Serialize};
use softgrasp_grasp::hand::{FingerAngles, Handedness, JointAngles, ThumbAngles};

use super::thumb::{THUMB_ROOT, ThumbCoupling};
use crate::devices::cyberglove::{RawSensors, Sensor, SensorCount, SensorSet};

/// How a glove without distal sensors gets the DIJ from the PIJ.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum DipRule {
    /// `0.32 θ² − 0.17 θ` of flexion θ in rad, as in the vendor's first library: a little
    /// overstretched for a slightly bent finger.
    Quadratic,
    /// `sign(θ) |0.32 θ² − 0.17 θ|`, as in the vendor's later library.
    #[default]
    SignedQuadratic,
    /// Two thirds of the PIJ, the usual figure of anatomical models.
    TwoThirds,
}

impl DipRule {
    /// DIJ flexion for a PIJ flexion, both in rad.
    pub fn dip_from_pip(self, pip: f64) -> f64 {
        let quadratic = 0.32 * pip * pip - 0.17 * pip;
        match self {
            Self::Quadratic => quadratic,
            Self::SignedQuadratic => quadratic.abs().copysign(pip),
            Self::TwoThirds => pip * 2.0 / 3.0,
        }
    }
}

/// The straight line of one sensor: angle = (raw − offset) · gain.
///
/// Abduction sensors between two fingers measure their spread, positive when apart.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SensorCalibration {
    /// Sensor that the line belongs to.
    pub sensor: Sensor,
    /// Raw value of the sensor in the flat hand.
    pub offset_counts: f64,
    /// Slope of the line; negative for a sensor whose value falls as its angle grows.
    pub gain_rad_per_count: f64,
    /// Smallest and largest angle that is believed.
    pub limits_rad: [f64; 2],
    /// Angle of the joint while the sensor is dead.
    pub rest_rad: f64,
    /// Whether the sensor is known to be dead.
    #[serde(default)]
    pub dead: bool,
}

impl SensorCalibration {
    fn angle(&self, raw: u8) -> f64 {
        self.believed(self.counts(raw) * self.gain_rad_per_count)
    }

    fn raw(&self, angle: f64) -> u8 {
        self.raw_at(angle / self.gain_rad_per_count)
    }

    /// Counts above the offset.
    fn counts(&self, raw: u8) -> f64 {
        f64::from(raw) - self.offset_counts
    }

    /// An angle held inside the believed range.
    fn believed(&self, angle: f64) -> f64 {
        let [low, high] = self.limits_rad;
        angle.clamp(low, high)
    }

    /// The reading this many counts above the offset.
    fn raw_at(&self, counts: f64) -> u8 {
        // A cast saturates and turns NaN into zero, so this is total.
        ((self.offset_counts + counts).round() as i64).clamp(1, 255) as u8
    }
}

/// Calibration of one glove on one hand.
///
/// It knows all 22 sensors, so it serves a glove with 18 as well. Angles are anatomical and so
/// the same for both hands; the vendor's library flips the sign of abductions and wrist yaw for a
/// left hand because it counts them about one fixed axis.
///
/// Source: thesis section 2.2.2 (gain and offset per sensor).
#[derive(Clone, Debug, PartialEq)]
pub struct Calibration {
    /// Right or left: hand that the glove is made for.
    pub hand: Handedness,
    /// Rule for the DIJ angles of a glove without distal sensors.
    pub dip_rule: DipRule,
    /// Share of the difference of both spreads that turns the middle finger itself; one half
    /// keeps index and ring finger symmetric.
    pub middle_bias: f64,
    /// What the two sensors at the root of the thumb add to each other; none by default.
    pub thumb_coupling: ThumbCoupling,
    /// One line per sensor, in the order of [`Sensor::ALL`].
    pub(super) sensors: [SensorCalibration; 22],
}

impl Calibration {
    /// The line of one sensor.
    pub fn sensor(&self, sensor: Sensor) -> &SensorCalibration {
        &self.sensors[sensor.index()]
    }

    /// Joint angles of one reading; joints of dead sensors are held at rest.
    ///
    /// `dead` comes on top of the sensors the calibration itself calls dead.
    pub fn angles(&self, raw: &RawSensors, dead: SensorSet) -> JointAngles {
        let live = |sensor: Sensor| {
            let alive = !self.sensor(sensor).dead && !dead.contains(sensor);
            raw.get(sensor).filter(|_| alive)
        };
        let angle = |sensor: Sensor| {
            let line = self.sensor(sensor);
            live(sensor).map_or(line.rest_rad, |value| line.angle(value))
        };
        let dip = |sensor: Sensor, pip: f64| match raw.count() {
            SensorCount::TwentyTwo => angle(sensor),
            SensorCount::Eighteen => {
                let [low, high] = self.sensor(sensor).limits_rad;
                self.dip_rule.dip_from_pip(pip).clamp(low, high)
            }
        };
        let finger = |[mcp, pip, distal]: [Sensor; 3], abduction: f64| {
            let pip_flexion = angle(pip);
            FingerAngles {
                mcp_flexion: angle(mcp),
                pip_flexion,
                dip_flexion: dip(distal, pip_flexion),
                abduction,
            }
        };
        // Spreads chain outward from the middle finger, positive abduction being toward the thumb.
        let spread_index = angle(Sensor::MiddleIndexAbduction);
        let spread_ring = angle(Sensor::RingMiddleAbduction);
        let middle = (spread_ring - spread_index) * self.middle_bias;
        let ring = middle - spread_ring;
        let little = ring - angle(Sensor::LittleRingAbduction);
        let [rotation, thumb_abduction] = self.thumb_root_angles(THUMB_ROOT.map(live));
        JointAngles {
            thumb: ThumbAngles {
                rotation,
                abduction: thumb_abduction,
                mcp_flexion: angle(Sensor::ThumbMcp),
                ip_flexion: angle(Sensor::ThumbIp),
            },
            index: finger(
                [Sensor::IndexMcp, Sensor::IndexPip, Sensor::IndexDip],
                middle + spread_index,
            ),
            middle: finger([Sensor::MiddleMcp, Sensor::MiddlePip, Sensor::MiddleDip], middle),
            ring: finger([Sensor::RingMcp, Sensor::RingPip, Sensor::RingDip], ring),
            little: finger([Sensor::LittleMcp, Sensor::LittlePip, Sensor::LittleDip], little),
            palm_arch: angle(Sensor::PalmArch),
            wrist_pitch: angle(Sensor::WristPitch),
            wrist_yaw: angle(Sensor::WristYaw),
        }
    }

    /// The reading a glove would give at these angles: rounded, held inside 1 to 255.
    ///
    /// The glove feels spreads only, so turning all fingers sideways together leaves no trace.
    pub fn raw_from_angles(&self, angles: &JointAngles, count: SensorCount) -> RawSensors {
        let wanted = THUMB_ROOT.map(|sensor| sensor_angle(angles, sensor));
        let thumb = self.thumb_coupling.counts(self.thumb_gains(), wanted);
        RawSensors::from_fn(count, |sensor| {
            let line = self.sensor(sensor);
            match THUMB_ROOT.iter().position(|&s| s == sensor) {
                Some(place) => line.raw_at(thumb[place]),
                None => line.raw(sensor_angle(angles, sensor)),
            }
        })
    }

    /// Own gains of the sensors of the thumb's rotation and abduction.
    pub(super) fn thumb_gains(&self) -> [f64; 2] {
        THUMB_ROOT.map(|sensor| self.sensor(sensor).gain_rad_per_count)
    }

    /// Rotation and abduction of the thumb from its two sensors; `None` for a dead one.
    fn thumb_root_angles(&self, live: [Option<u8>; 2]) -> [f64; 2] {
        let lines = THUMB_ROOT.map(|sensor| self.sensor(sensor));
        let gains = self.thumb_gains();
        let coupling = &self.thumb_coupling;
        let angles = match live {
            [Some(r), Some(a)] => coupling.angles(gains, [lines[0].counts(r), lines[1].counts(a)]),
            [Some(r), None] => {
                coupling.angles_beside_dead(gains, 1, lines[1].rest_rad, lines[0].counts(r))
            }
            [None, Some(a)] => {
                coupling.angles_beside_dead(gains, 0, lines[0].rest_rad, lines[1].counts(a))
            }
            [None, None] => lines.map(|line| line.rest_rad),
        };
        [lines[0].believed(angles[0]), lines[1].believed(angles[1])]
    }

    /// The sensors the calibration itself calls dead.
    pub fn dead(&self) -> SensorSet {
        self.sensors.iter().filter(|line| line.dead).map(|line| line.sensor).collect()
    }
}

/// What one sensor feels at the given joint angles, in rad.
pub fn sensor_angle(angles: &JointAngles, sensor: Sensor) -> f64 {
    let a = angles;
    match sensor {
        Sensor::ThumbRotation => a.thumb.rotation,
        Sensor::ThumbMcp => a.thumb.mcp_flexion,
        Sensor::ThumbIp => a.thumb.ip_flexion,
        Sensor::ThumbAbduction => a.thumb.abduction,
        Sensor::IndexMcp => a.index.mcp_flexion,
        Sensor::IndexPip => a.index.pip_flexion,
        Sensor::IndexDip => a.index.dip_flexion,
        Sensor::MiddleMcp => a.middle.mcp_flexion,
        Sensor::MiddlePip => a.middle.pip_flexion,
        Sensor::MiddleDip => a.middle.dip_flexion,
        Sensor::MiddleIndexAbduction => a.index.abduction - a.middle.abduction,
        Sensor::RingMcp => a.ring.mcp_flexion,
        Sensor::RingPip => a.ring.pip_flexion,
        Sensor::RingDip => a.ring.dip_flexion,
        Sensor::RingMiddleAbduction => a.middle.abduction - a.ring.abduction,
        Sensor::LittleMcp => a.little.mcp_flexion,
        Sensor::LittlePip => a.little.pip_flexion,
        Sensor::LittleDip => a.little.dip_flexion,
        Sensor::LittleRingAbduction => a.ring.abduction - a.little.abduction,
        Sensor::PalmArch => a.palm_arch,
        Sensor::WristPitch => a.wrist_pitch,
        Sensor::WristYaw => a.wrist_yaw,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn any_count() -> impl Strategy<Value = SensorCount> {
        prop_oneof![Just(SensorCount::Eighteen), Just(SensorCount::TwentyTwo)]
    }

    fn any_raw() -> impl Strategy<Value = RawSensors> {
        (any_count(), prop::array::uniform22(1u8..=255)).prop_map(|(count, values)| {
            RawSensors::try_new(count, &values[..count.number()]).unwrap()
        })
    }

    /// Angles a glove can express: of the given fraction of each sensor's believed range.
    fn reachable(calibration: &Calibration, fractions: &[f64; 22]) -> [f64; 22] {
        let mut angles = [0.0; 22];
        for sensor in Sensor::ALL {
            let line = calibration.sensor(sensor);
            let ends = [1.0, 255.0].map(|raw| (raw - line.offset_counts) * line.gain_rad_per_count);
            let low = line.limits_rad[0].max(ends[0].min(ends[1]));
            let high = line.limits_rad[1].min(ends[0].max(ends[1]));
            angles[sensor.index()] = low + (high - low) * fractions[sensor.index()];
        }
        angles
    }

    proptest! {
        #[test]
        fn an_angle_comes_back_within_half_a_gain(fractions in prop::array::uniform22(0.0..1.0f64)) {
            let calibration = Calibration::default();
            let wanted = reachable(&calibration, &fractions);
            for sensor in Sensor::ALL {
                let line = calibration.sensor(sensor);
                let back = line.angle(line.raw(wanted[sensor.index()]));
                let off = (back - wanted[sensor.index()]).abs();
                prop_assert!(off <= 0.5 * line.gain_rad_per_count.abs() + 1e-12, "{sensor:?}");
            }
        }

        #[test]
        fn a_reading_survives_angles_and_back(raw in any_raw()) {
            let calibration = Calibration::default();
            let angles = calibration.angles(&raw, SensorSet::EMPTY);
            let back = calibration.raw_from_angles(&angles, raw.count());
            for sensor in raw.count().wire_order() {
                let line = calibration.sensor(sensor);
                let unlimited = (f64::from(raw.get(sensor).unwrap()) - line.offset_counts)
                    * line.gain_rad_per_count;
                let [low, high] = line.limits_rad;
                if (low..=high).contains(&unlimited) {
                    prop_assert_eq!(back.get(sensor), raw.get(sensor), "{:?}", sensor);
                }
            }
        }

        #[test]
        fn every_reading_gives_angles_inside_the_limits(raw in any_raw(), dead in any::<u32>()) {
            let calibration = Calibration::default();
            let dead: SensorSet =
                Sensor::ALL.into_iter().filter(|s| dead >> s.index() & 1 == 1).collect();
            let angles = calibration.angles(&raw, dead);
            for sensor in Sensor::ALL {
                let [low, high] = calibration.sensor(sensor).limits_rad;
                let angle = sensor_angle(&angles, sensor);
                prop_assert!(low - 1e-12 <= angle && angle <= high + 1e-12, "{sensor:?} {angle}");
                let measured = raw.get(sensor).is_some();
                if measured && dead.contains(sensor) {
                    prop_assert!((angle - calibration.sensor(sensor).rest_rad).abs() < 1e-12);
                }
            }
        }
    }

    /// A reading with some sensors a number of counts above their offset, the rest at it.
    fn reading(changes: &[(Sensor, i32)], count: SensorCount) -> RawSensors {
        let calibration = Calibration::default();
        RawSensors::from_fn(count, |sensor| {
            let change = changes.iter().find(|c| c.0 == sensor).map_or(0, |c| c.1);
            (calibration.sensor(sensor).offset_counts as i32 + change) as u8
        })
    }

    #[test]
    fn counts_at_the_offsets_are_a_flat_hand() {
        let calibration = Calibration::default();
        for count in [SensorCount::Eighteen, SensorCount::TwentyTwo] {
            let angles = calibration.angles(&reading(&[], count), SensorSet::EMPTY);
            assert!(angles.to_array().iter().all(|a| a.abs() < 1e-12), "{angles:?}");
        }
    }

    #[test]
    fn spreads_chain_from_the_middle_finger() {
        let calibration = Calibration::default();
        let changes = [
            (Sensor::MiddleIndexAbduction, 40),
            (Sensor::RingMiddleAbduction, 20),
            (Sensor::LittleRingAbduction, 30),
        ];
        let raw = reading(&changes, SensorCount::TwentyTwo);
        let angles = calibration.angles(&raw, SensorSet::EMPTY);
        let [i, r, l] = changes.map(|(sensor, counts)| {
            f64::from(counts) * calibration.sensor(sensor).gain_rad_per_count
        });
        let m = (r - i) / 2.0;
        assert!((angles.middle.abduction - m).abs() < 1e-12);
        assert!((angles.index.abduction - (m + i)).abs() < 1e-12);
        assert!((angles.ring.abduction - (m - r)).abs() < 1e-12);
        assert!((angles.little.abduction - (m - r - l)).abs() < 1e-12);
        assert!((angles.index.abduction + angles.ring.abduction).abs() < 1e-12, "symmetric");
    }

    #[test]
    fn eighteen_sensors_take_the_distal_joint_from_the_rule() {
        let raw = reading(&[(Sensor::IndexPip, 90)], SensorCount::Eighteen);
        let calibration = Calibration::default();
        let angles = calibration.angles(&raw, SensorSet::EMPTY);
        let pip = 90.0 * 0.01459;
        assert!((angles.index.pip_flexion - pip).abs() < 1e-12);
        assert!((angles.index.dip_flexion - (0.32 * pip * pip - 0.17 * pip)).abs() < 1e-12);
    }

    #[test]
    fn distal_rules_have_the_documented_values() {
        let right_angle = std::f64::consts::FRAC_PI_2;
        for rule in [DipRule::Quadratic, DipRule::SignedQuadratic] {
            assert!((rule.dip_from_pip(right_angle).to_degrees() - 30.0).abs() < 0.1);
        }
        assert!(DipRule::Quadratic.dip_from_pip(0.2) < 0.0);
        assert!(DipRule::SignedQuadratic.dip_from_pip(0.2) > 0.0);
        assert!(DipRule::SignedQuadratic.dip_from_pip(-0.2) < 0.0);
        assert_eq!(DipRule::TwoThirds.dip_from_pip(0.9), 0.6);
    }

    #[test]
    fn thumb_rotation_is_clamped_outside_the_palm() {
        let raw = RawSensors::from_fn(SensorCount::TwentyTwo, |_| 1);
        let angles = Calibration::default().angles(&raw, SensorSet::EMPTY);
        assert_eq!(angles.thumb.rotation, -0.5);
    }

    #[test]
    fn coupled_thumb_angles_come_back_from_their_counts() {
        let thumb_coupling = ThumbCoupling {
            rotation_rad_per_abduction_count: 0.002,
            abduction_rad_per_rotation_count: -0.0015,
        };
        let calibration = Calibration { thumb_coupling, ..Calibration::default() };
        let mut angles = JointAngles::flat();
        (angles.thumb.rotation, angles.thumb.abduction) = (0.6, 0.25);
        let raw = calibration.raw_from_angles(&angles, SensorCount::TwentyTwo);
        let alone = Calibration::default().raw_from_angles(&angles, SensorCount::TwentyTwo);
        assert_ne!(raw, alone, "the coupling moves the counts");
        let back = calibration.angles(&raw, SensorSet::EMPTY).thumb;
        // Half a count of each sensor through both terms.
        assert!((back.rotation - 0.6).abs() <= 0.5 * (0.01584 + 0.002));
        assert!((back.abduction - 0.25).abs() <= 0.5 * (0.00502 + 0.0015));
        let dead: SensorSet = [Sensor::ThumbRotation].into_iter().collect();
        let held = calibration.angles(&raw, dead).thumb;
        assert_eq!(held.rotation, 0.0);
        assert!((held.abduction - back.abduction).abs() < 0.1, "{}", held.abduction);
    }

    #[test]
    fn not_a_number_becomes_the_smallest_count() {
        let mut angles = JointAngles::flat();
        angles.palm_arch = f64::NAN;
        angles.wrist_pitch = f64::INFINITY;
        let raw = Calibration::default().raw_from_angles(&angles, SensorCount::TwentyTwo);
        assert_eq!(raw.get(Sensor::PalmArch), Some(1));
        assert_eq!(raw.get(Sensor::WristPitch), Some(255));
    }
}
