//! Smallest and largest joint angles that a fit may give.

use softgrasp_grasp::hand::{ANGLE_COUNT, JointAngles};

/// Range of every joint angle.
///
/// Units: rad. Shapes and order: [`JointAngles::to_array`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AngleLimits {
    /// Smallest angles.
    pub low: [f64; ANGLE_COUNT],
    /// Largest angles.
    pub high: [f64; ANGLE_COUNT],
}

/// Metacarpophalangeal, proximal and distal joint: what the glove's calibration believes.
const FLEXIONS: [[f64; 2]; 3] = [[-0.6, 1.75], [-0.2, 2.1], [-0.2, 1.6]];
/// Abduction of index, middle, ring and little finger, toward the thumb positive: the limits of the
/// GraspDB14 skeleton as far as they exceed 30 degrees, and a margin, because hands differ in the
/// directions of their flat fingers too.
const ABDUCTIONS: [[f64; 2]; 4] = [[-0.6, 0.6], [-0.5, 0.5], [-0.6, 0.5], [-0.8, 0.6]];
/// Thumb rotation, metacarpophalangeal, interphalangeal joint and abduction.
const THUMB: [[f64; 2]; 4] = [[-0.5, 1.6], [-0.6, 1.4], [-0.7, 1.6], [-0.5, 0.8]];
/// Cupping of the palm.
const ARCH: [f64; 2] = [-0.1, 0.8];

impl Default for AngleLimits {
    /// Flexions, thumb and palm arch as the default calibration believes them; wrist angles are
    /// zero, because joints of a hand say nothing about the forearm.
    fn default() -> Self {
        let mut limits = Self { low: [0.0; ANGLE_COUNT], high: [0.0; ANGLE_COUNT] };
        let fingers = ABDUCTIONS.into_iter().flat_map(|abduction| {
            let [mcp, pip, dip] = FLEXIONS;
            [mcp, pip, dip, abduction]
        });
        let ranges = THUMB.into_iter().chain(fingers).chain([ARCH]);
        for (slot, [low, high]) in ranges.enumerate() {
            limits.low[slot] = low;
            limits.high[slot] = high;
        }
        limits
    }
}

impl AngleLimits {
    /// The nearest angles within the limits.
    pub fn clamp(&self, angles: &JointAngles) -> JointAngles {
        let mut array = angles.to_array();
        for (slot, angle) in array.iter_mut().enumerate() {
            *angle = angle.clamp(self.low[slot], self.high[slot]);
        }
        JointAngles::from_array(&array)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::devices::calibration::Calibration;
    use crate::devices::cyberglove::Sensor;

    #[test]
    fn flexions_thumb_and_arch_are_what_the_calibration_believes() {
        let limits = AngleLimits::default();
        let calibration = Calibration::default();
        let slots = [
            (Sensor::ThumbRotation, 0),
            (Sensor::ThumbMcp, 1),
            (Sensor::ThumbIp, 2),
            (Sensor::ThumbAbduction, 3),
            (Sensor::IndexMcp, 4),
            (Sensor::MiddlePip, 9),
            (Sensor::LittleDip, 18),
            (Sensor::PalmArch, 20),
        ];
        for (sensor, slot) in slots {
            let [low, high] = calibration.sensor(sensor).limits_rad;
            assert_eq!([limits.low[slot], limits.high[slot]], [low, high], "{sensor:?}");
        }
    }

    #[test]
    fn flat_and_fist_are_within_the_limits() {
        let limits = AngleLimits::default();
        for angles in [JointAngles::flat(), JointAngles::fist()] {
            assert_eq!(limits.clamp(&angles), angles);
        }
        let bent = JointAngles { wrist_pitch: 0.3, palm_arch: 2.0, ..JointAngles::flat() };
        let clamped = limits.clamp(&bent);
        assert_eq!((clamped.wrist_pitch, clamped.palm_arch), (0.0, 0.8));
    }
}
