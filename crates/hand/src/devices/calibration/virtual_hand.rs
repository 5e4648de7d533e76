//! The vendor's VirtualHand `.cal` text: its table, its signs, and how it is written.

use std::fmt::Write as _;

use super::linear::Calibration;
use super::virtual_hand_notes::notes_of;
use crate::devices::cyberglove::{Sensor, SensorCount};

/// What one line of the vendor's table belongs to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Slot {
    /// Offset and gain of a sensor.
    Sensor(Sensor),
    /// The index finger's abduction has no sensor of its own: the line holds the gain of the
    /// spread between middle and index finger.
    IndexAbduction,
    /// The middle finger's abduction: the line holds the offset of the spread between middle and
    /// index finger, and in the place of the gain the share `middle_bias`.
    MiddleAbduction,
    /// The line belongs to no joint.
    Unused,
}

/// Lines of the table: `FINGER` 0 (thumb) to 4 (little) and 5 (carpus), joints 0 to 3.
pub(super) const SLOTS: [[Slot; 4]; 6] = {
    use Sensor as S;
    use Slot::{IndexAbduction, MiddleAbduction, Sensor as Of, Unused};
    [
        [Of(S::ThumbRotation), Of(S::ThumbMcp), Of(S::ThumbIp), Of(S::ThumbAbduction)],
        [Of(S::IndexMcp), Of(S::IndexPip), Of(S::IndexDip), IndexAbduction],
        [Of(S::MiddleMcp), Of(S::MiddlePip), Of(S::MiddleDip), MiddleAbduction],
        [Of(S::RingMcp), Of(S::RingPip), Of(S::RingDip), Of(S::RingMiddleAbduction)],
        [Of(S::LittleMcp), Of(S::LittlePip), Of(S::LittleDip), Of(S::LittleRingAbduction)],
        [Of(S::PalmArch), Of(S::WristPitch), Of(S::WristYaw), Unused],
    ]
};

/// Turns a gain of this program into one of the vendor's file, and back.
///
/// The vendor's angle is (raw − offset) · (−gain), a turn about one fixed axis: flexion is
/// negative, and for a left hand abductions and yaw are negated afterwards. This program's angle is
/// (raw − offset) · gain with flexion positive and sideways angles counted anatomically, the same
/// for both hands. So
///
/// - flexions: both minus signs cancel and the gain is the same number;
/// - spreads of the fingers: the vendor's chain counts them positive apart for a positive gain, as
///   this program does, and its sign for the left hand only undoes the fixed axis;
/// - thumb abduction: the same number; which way the sensor grows is not documented, and a fit to
///   gestures finds the sign whatever it is;
/// - wrist yaw: this program counts it toward the thumb, which is a positive turn of a right hand
///   about the vendor's axis, so one minus sign stays.
pub(super) fn vendor_gain(sensor: Sensor, gain_rad_per_count: f64) -> f64 {
    match sensor {
        Sensor::WristYaw => -gain_rad_per_count,
        _ => gain_rad_per_count,
    }
}

/// An offset as it is printed: a whole number of the glove's range.
pub(super) fn printed_offset(offset_counts: f64) -> f64 {
    // The sum turns minus zero into zero.
    offset_counts.round().clamp(0.0, 255.0) + 0.0
}

/// A gain or share as it is printed: five digits behind the point.
pub(super) fn printed_gain(gain: f64) -> f64 {
    // Text and number cannot disagree: this is the printed text, read.
    format!("{gain:.5}").parse().unwrap_or(gain)
}

/// What stands in the comments at the head of a written file.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CalibrationHeader<'a> {
    /// Program and version that write the file.
    pub program: &'a str,
    /// Date of the calibration, for example `2026-11-22`.
    pub date: &'a str,
    /// Sensors of the glove.
    pub sensors: SensorCount,
    /// Length and breadth of the hand in m, where they are known.
    pub hand_size_m: Option<[f64; 2]>,
}

/// A calibration as VirtualHand text.
///
/// Lines are at most 80 characters. What the vendor's table cannot hold (which hand, believed
/// ranges, rest angles, dead sensors, the rule for distal joints, thumb coupling, digits beyond
/// the printed ones) stands in comment lines `! softgrasp KEY VALUE`, which other readers skip;
/// with them the text comes back as exactly this calibration.
pub fn virtual_hand_text(calibration: &Calibration, header: &CalibrationHeader<'_>) -> String {
    let mut text = String::from("VHv1.0\n");
    for line in header_lines(calibration, header) {
        let short: String = line.chars().filter(|c| !c.is_control()).take(76).collect();
        // Writing to a string cannot fail.
        let _ = writeln!(text, "! {short}");
    }
    for (key, value) in notes_of(calibration) {
        let _ = writeln!(text, "! softgrasp {key} {value}");
    }
    text.push_str("!\nGLOVE CALIBRATION follows:\n! joint, offset, gain, gesture\n");
    for (finger, joints) in SLOTS.iter().enumerate() {
        let _ = writeln!(text, "FINGER {finger}:");
        for (joint, &slot) in joints.iter().enumerate() {
            let (offset, gain) = numbers_of(calibration, slot);
            let offset = printed_offset(offset);
            let _ = writeln!(text, "{joint:>3} {offset:>6} {gain:>10.5} {:>5}", 0);
        }
    }
    text.push_str("! E_O_CAL\n!\n");
    text
}

/// Offset and gain of one line of the table, in the vendor's convention.
fn numbers_of(calibration: &Calibration, slot: Slot) -> (f64, f64) {
    let of = |sensor: Sensor| {
        let line = calibration.sensor(sensor);
        (line.offset_counts, vendor_gain(sensor, line.gain_rad_per_count))
    };
    match slot {
        Slot::Sensor(sensor) => of(sensor),
        Slot::IndexAbduction => of(Sensor::MiddleIndexAbduction),
        Slot::MiddleAbduction => (of(Sensor::MiddleIndexAbduction).0, calibration.middle_bias),
        Slot::Unused => (0.0, 0.0),
    }
}

/// Comment lines at the head of the file, for the person who reads it.
fn header_lines(calibration: &Calibration, header: &CalibrationHeader<'_>) -> Vec<String> {
    let hand = calibration.hand.name();
    let mut lines = vec![
        "Calibration of an instrumented glove, VirtualHand form".to_owned(),
        format!("written by {}", header.program),
        format!("date {}", header.date),
        format!("{hand} hand, {} sensors", header.sensors.number()),
    ];
    if let Some([length_m, breadth_m]) = header.hand_size_m {
        lines.push(format!("hand length {length_m} m, hand breadth {breadth_m} m"));
    }
    lines.push("vendor's signs: angle = (raw - offset) * -gain, flexion negative".to_owned());
    lines
}
