//! The calibration of an average glove, to start from.

use softgrasp_grasp::hand::Handedness;

use super::linear::{Calibration, DipRule, SensorCalibration};
use super::thumb::ThumbCoupling;
use crate::devices::cyberglove::Sensor;

impl Default for Calibration {
    /// The vendor library's gains, and offsets and ranges that fit them.
    ///
    /// Gains of flexion, palm arch and wrist are those of the vendor's library, read off the steps
    /// of two public data sets. Gains of the three finger spreads, all offsets and the ranges are
    /// this project's: offsets put the flat hand where public raw data begin, ranges are the active
    /// ranges of adults with a margin.
    fn default() -> Self {
        let sensors = Sensor::ALL.map(|sensor| {
            let (offset_counts, gain_rad_per_count, limits_rad) = line(sensor);
            SensorCalibration {
                sensor,
                offset_counts,
                gain_rad_per_count,
                limits_rad,
                rest_rad: 0.0,
                dead: false,
            }
        });
        Self {
            hand: Handedness::Right,
            dip_rule: DipRule::default(),
            middle_bias: 0.5,
            thumb_coupling: ThumbCoupling::default(),
            sensors,
        }
    }
}

/// Offset in counts, gain in rad per count, believed range in rad.
fn line(sensor: Sensor) -> (f64, f64, [f64; 2]) {
    const MCP: [f64; 2] = [-0.6, 1.75];
    const PIP: [f64; 2] = [-0.2, 2.1];
    const DIP: [f64; 2] = [-0.2, 1.6];
    const SPREAD: [f64; 2] = [-0.25, 0.7];
    match sensor {
        // The vendor's library never lets the thumb rotate further out than half a radian.
        Sensor::ThumbRotation => (60.0, 0.01584, [-0.5, 1.6]),
        Sensor::ThumbMcp => (80.0, 0.01459, [-0.6, 1.4]),
        Sensor::ThumbIp => (80.0, 0.01427, [-0.7, 1.6]),
        Sensor::ThumbAbduction => (100.0, 0.00502, [-0.5, 0.8]),
        Sensor::IndexMcp => (60.0, 0.01616, MCP),
        Sensor::IndexPip => (60.0, 0.01459, PIP),
        Sensor::IndexDip => (40.0, 0.00753, DIP),
        Sensor::MiddleMcp => (60.0, 0.01725, MCP),
        Sensor::MiddlePip => (60.0, 0.01804, PIP),
        Sensor::MiddleDip => (40.0, 0.01051, DIP),
        Sensor::MiddleIndexAbduction => (80.0, 0.005, SPREAD),
        Sensor::RingMcp => (60.0, 0.01757, MCP),
        Sensor::RingPip => (60.0, 0.01788, PIP),
        Sensor::RingDip => (40.0, 0.01051, DIP),
        Sensor::RingMiddleAbduction => (80.0, 0.005, SPREAD),
        Sensor::LittleMcp => (60.0, 0.01663, MCP),
        Sensor::LittlePip => (60.0, 0.01820, PIP),
        Sensor::LittleDip => (40.0, 0.00988, DIP),
        Sensor::LittleRingAbduction => (80.0, 0.005, SPREAD),
        Sensor::PalmArch => (60.0, 0.00910, [-0.1, 0.8]),
        Sensor::WristPitch => (150.0, 0.00863, [-1.45, 1.1]),
        // The vendor's line falls for every angle about the same axis; yaw here is toward the thumb.
        Sensor::WristYaw => (128.0, -0.00392, [-0.6, 0.4]),
    }
}
