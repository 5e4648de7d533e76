//! The forms of a calibration: written and read back, public layouts, damaged texts.

use proptest::prelude::*;
use softgrasp_grasp::hand::{Handedness, JointAngles};

use super::*;
use crate::devices::calibration::checks::check;
use crate::devices::calibration::{
    CalibrationHeader, DipRule, ThumbCoupling, sensor_angle, toml_text, virtual_hand_text,
};
use crate::devices::cyberglove::{RawSensors, Sensor, SensorCount, SensorSet};

const HEADER: CalibrationHeader<'static> = CalibrationHeader {
    program: "glove-client 0.0",
    date: "2026-11-22",
    sensors: SensorCount::TwentyTwo,
    hand_size_m: Some([0.185, 0.084]),
};

fn written() -> String {
    virtual_hand_text(&Calibration::default(), &HEADER)
}

/// The lines of a file that other readers see.
fn table_only(text: &str) -> String {
    text.lines().filter(|line| !line.starts_with("! softgrasp")).map(|l| format!("{l}\n")).collect()
}

fn any_calibration() -> impl Strategy<Value = Calibration> {
    let numbers = (
        prop::array::uniform22(-20.0..300.0f64),
        prop::array::uniform22(prop_oneof![0.001..0.4f64, -0.4..-0.001f64]),
        prop::array::uniform22(-1.0..0.0f64),
        prop::array::uniform22(0.0..2.0f64),
    );
    let flags = (any::<bool>(), 0..3usize, 0.0..1.0f64, any::<u32>(), any::<bool>());
    (numbers, flags).prop_map(
        |((offsets, gains, lows, highs), (left, rule, bias, dead, coupled))| {
            let mut calibration = Calibration::default();
            for sensor in Sensor::ALL {
                let i = sensor.index();
                let line = &mut calibration.sensors[i];
                (line.offset_counts, line.gain_rad_per_count) = (offsets[i], gains[i]);
                line.limits_rad = [lows[i], highs[i]];
                line.rest_rad = 0.5 * (lows[i] + highs[i]);
                line.dead = dead >> i & 1 == 1;
            }
            if left {
                calibration.hand = Handedness::Left;
            }
            calibration.dip_rule =
                [DipRule::Quadratic, DipRule::SignedQuadratic, DipRule::TwoThirds][rule];
            calibration.middle_bias = bias;
            if coupled {
                calibration.thumb_coupling = ThumbCoupling {
                    rotation_rad_per_abduction_count: 0.2 * gains[0],
                    abduction_rad_per_rotation_count: -0.3 * gains[3],
                };
            }
            calibration
        },
    )
}

#[test]
fn default_calibration_is_written_as_the_vendor_writes() {
    let text = written();
    assert!(text.starts_with("VHv1.0\n! Calibration of an instrumented glove"));
    for line in [
        "! date 2026-11-22",
        "! right hand, 22 sensors",
        "! hand length 0.185 m, hand breadth 0.084 m",
        "GLOVE CALIBRATION follows:",
        "FINGER 0:\n  0     60    0.01584     0\n  1     80    0.01459     0\n",
        // The spread of index and middle finger: gain here, offset and share with the next finger.
        "FINGER 1:\n  0     60    0.01616     0\n  1     60    0.01459     0\n  2     40    0.00753     \
         0\n  3     80    0.00500     0\n",
        "  3     80    0.50000     0\nFINGER 3:",
        // The vendor's gain of the wrist's yaw is positive.
        "  2    128    0.00392     0\n  3      0    0.00000     0\n! E_O_CAL",
    ] {
        assert!(text.contains(line), "{line}\n---\n{text}");
    }
}

#[test]
fn vendor_angles_of_a_written_file_are_those_of_this_program() {
    // An oracle: the vendor's own rule, as the facts on the device state it, on the vendor's table.
    let calibration = Calibration::default();
    let row = |finger: usize, joint: usize| -> (f64, f64) {
        let text = written();
        let block = text.split(&format!("FINGER {finger}:\n")).nth(1).unwrap();
        let fields: Vec<f64> = block
            .lines()
            .nth(joint)
            .unwrap()
            .split_whitespace()
            .map(|f| f.parse().unwrap())
            .collect();
        (fields[1], fields[2])
    };
    let raw = RawSensors::from_fn(SensorCount::TwentyTwo, |s| 70 + 2 * s.index() as u8);
    let angles = calibration.angles(&raw, SensorSet::EMPTY);
    let vendor = |finger: usize, joint: usize, sensor: Sensor| {
        let (offset, gain) = row(finger, joint);
        (f64::from(raw.get(sensor).unwrap()) - offset) * -gain
    };
    let close = |a: f64, b: f64| assert!((a - b).abs() < 1e-9, "{a} {b}");
    close(vendor(1, 0, Sensor::IndexMcp), -angles.index.mcp_flexion);
    close(vendor(5, 1, Sensor::WristPitch), -angles.wrist_pitch);
    // Yaw of a right hand: a positive turn about the axis out of its back is toward the thumb.
    close(vendor(5, 2, Sensor::WristYaw), angles.wrist_yaw);
    let (gain_i, gain_m) = (row(1, 3).1, row(2, 3).1);
    let i = (f64::from(raw.get(Sensor::MiddleIndexAbduction).unwrap()) - row(2, 3).0) * gain_i;
    let ring_middle = vendor(3, 3, Sensor::RingMiddleAbduction);
    let m = -(ring_middle + i) * gain_m;
    close(m, angles.middle.abduction);
    close(i + m, angles.index.abduction);
    close(ring_middle + m, angles.ring.abduction);
    let little = vendor(4, 3, Sensor::LittleRingAbduction) + ring_middle + m;
    close(little, angles.little.abduction);
}

#[test]
fn a_vendor_file_without_our_comments_is_read() {
    let text = table_only(&written());
    let (read, form) = read_calibration(&text).unwrap();
    assert_eq!((form, &read), (Form::VirtualHand, &Calibration::default()));
    let with_geometry =
        format!("{text}! ==\n3D HAND GEOMETRY follows:\n! ==\nLEFT HAND.\n  1.0 2.0 3.0\n");
    let (left, _) = read_calibration(&with_geometry).unwrap();
    assert_eq!(left.hand, Handedness::Left);
    // The angles are anatomical: the same for both hands.
    assert_eq!(Calibration { hand: Handedness::Right, ..left }, read);
    let windows = text.replace('\n', "\r\n");
    assert_eq!(read_calibration(&windows).unwrap().0, read);
}

#[test]
fn numbers_edited_in_the_table_win_over_the_exact_ones() {
    let text = written().replacen("  0     60    0.01584", "  0     61    0.01584", 1);
    let (read, _) = read_calibration(&text).unwrap();
    assert_eq!(read.sensor(Sensor::ThumbRotation).offset_counts, 61.0);
    let left_out = written().replacen("  0     60    0.00910", "  0     60    0.00000", 1);
    let (read, _) = read_calibration(&left_out).unwrap();
    assert!(read.sensor(Sensor::PalmArch).dead, "a gain of zero leaves a sensor out");
}

#[test]
fn errors_name_the_line_and_what_was_expected() {
    let refused = |from: &str, to: &str| {
        let changed = written().replacen(from, to, 1);
        assert_ne!(changed, written(), "{from} is in the text");
        read_calibration(&changed).unwrap_err().to_string()
    };
    let line = |part: &str| written().lines().position(|l| l == part).unwrap() + 1;
    let finger = line("FINGER 3:");
    assert_eq!(
        refused("FINGER 3:", "FINGER 9:"),
        format!("line {finger}: expected `FINGER 0:` to 5, found `FINGER 9:`")
    );
    assert_eq!(
        refused("FINGER 3:", "FINGER 2:"),
        format!(
            "line {}: expected each finger once, found `0     60    0.01757     0`",
            finger + 1
        )
    );
    let row = line("  0     60    0.01616     0");
    assert_eq!(
        refused("  0     60    0.01616", "  0     sixty 0.01616"),
        format!(
            "line {row}: expected joint 0, its offset and its gain, found `0     sixty 0.01616     0`"
        )
    );
    assert_eq!(
        refused("  0     60    0.01616", "  0     60    7.01616"),
        format!("line {row}: gain_rad_per_count of sensor IndexMcp is 7.01616, which cannot be")
    );
    assert!(
        refused("! softgrasp hand right", "! softgrasp hand both")
            .contains("expected right or left")
    );
    assert!(refused("! softgrasp hand", "! softgrasp hands").contains("expected a known key"));
    let short = written().split("FINGER 5:").next().unwrap().to_owned();
    assert_eq!(
        read_calibration(&short).unwrap_err().to_string(),
        "the text ends where `FINGER 5:` should follow"
    );
    for text in ["", "hello", "! only a comment", "20 25"] {
        assert!(read_calibration(text).is_err(), "{text}");
    }
}

/// A point list as the ASR library writes it; numbers of this test.
fn point_list() -> String {
    let mut lines = vec!["0.000000:60.000000 -1.000000:160.000000".to_owned(); 22];
    lines[0] = "0.300000:50.000000 -0.500000:150.000000".to_owned();
    lines[7] = "-0.200000:170.000000 0.200000:120.000000".to_owned();
    lines[11] = "0.000000:60.000000 0.000000:144.000000".to_owned();
    lines[15] = "0.270000:134.000000 0.000000:86.000000".to_owned();
    lines.join("\n") + "\n"
}

#[test]
fn point_lists_become_lines_with_flexion_positive() {
    let (read, form) = read_calibration(&point_list()).unwrap();
    assert_eq!(form, Form::PointList);
    let index = read.sensor(Sensor::IndexMcp);
    assert!(
        (index.gain_rad_per_count - 0.01).abs() < 1e-12
            && (index.offset_counts - 60.0).abs() < 1e-9
    );
    let yaw = read.sensor(Sensor::WristYaw);
    assert!((yaw.gain_rad_per_count + 0.008).abs() < 1e-12);
    assert!((yaw.offset_counts - 87.5).abs() < 1e-9);
    let spread = read.sensor(Sensor::MiddleIndexAbduction);
    assert!((spread.gain_rad_per_count - 0.008).abs() < 1e-12);
    assert!(read.sensor(Sensor::RingMiddleAbduction).gain_rad_per_count > 0.0);
    let palm = Calibration::default();
    assert_eq!(
        read.sensor(Sensor::PalmArch),
        palm.sensor(Sensor::PalmArch),
        "one angle says nothing"
    );
    let short: String = point_list().lines().take(21).map(|l| format!("{l}\n")).collect();
    assert!(matches!(read_calibration(&short), Err(CalibrationError::Ends { .. })));
    let broken = point_list().replacen("0.300000:50.000000", "0.300000:50.000000 x", 1);
    assert!(read_calibration(&broken).unwrap_err().to_string().starts_with("line 1: expected"));
}

const XML: &str = r#"<?xml version="1.0" ?>
<Cyberglove_calibration>
<!-- <Joint name="nobody"> -->
<Joint name="G_IndexMPJ">
<calib raw_value="0.25" calibrated_value="0"/>
<calib raw_value='0.75' calibrated_value='90.0'/>
</Joint>
<Joint name="G_WristYaw">
<calib raw_value="0.6" calibrated_value="10"/>
<calib raw_value="0.2" calibrated_value="-30"/>
</Joint>
</Cyberglove_calibration>
"#;

#[test]
fn joints_in_xml_become_lines_in_counts_and_radians() {
    let (read, form) = read_calibration(XML).unwrap();
    assert_eq!(form, Form::JointXml);
    let index = read.sensor(Sensor::IndexMcp);
    assert!((index.offset_counts - (1.0 + 254.0 * 0.25)).abs() < 1e-9);
    let right_angle = std::f64::consts::FRAC_PI_2;
    assert!((index.gain_rad_per_count - right_angle / 127.0).abs() < 1e-12);
    assert!(read.sensor(Sensor::WristYaw).gain_rad_per_count > 0.0);
    assert_eq!(read.sensor(Sensor::RingMcp), Calibration::default().sensor(Sensor::RingMcp));
    let refused = |from: &str, to: &str| {
        let changed = XML.replacen(from, to, 1);
        read_calibration(&changed).unwrap_err().to_string()
    };
    assert!(refused("G_IndexMPJ", "G_Index").starts_with("line 4: expected `name="));
    assert!(refused("0.25", "a quarter").starts_with("line 5: expected `raw_value="));
    assert!(refused("G_WristYaw", "G_IndexMPJ").starts_with("line 8: sensor IndexMcp is listed"));
    assert!(
        refused("</Cyberglove_calibration>", "</Cyber").starts_with("line 12: expected a closing")
    );
    assert!(matches!(read_calibration("<a></a>"), Err(CalibrationError::Ends { .. })));
}

/// A matrix as GraspIt's, with numbers of this test.
fn matrix() -> String {
    let mut slopes = vec![[0.0f64; 24]; 20];
    slopes[0][10] = -0.005;
    slopes[1][4] = 0.015;
    slopes[12][18] = 0.010;
    slopes[12][14] = -0.001;
    slopes[16][0] = -0.017;
    slopes[16][3] = 0.013;
    slopes[17][0] = 0.011;
    slopes[17][3] = 0.015;
    let mut constants = [0.0; 20];
    (constants[0], constants[1], constants[12]) = (0.9, -1.2, -1.4);
    (constants[16], constants[17]) = (1.5, -3.5);
    let row =
        |numbers: &[f64]| numbers.iter().map(|n| format!("{n:.6} ")).collect::<String>() + "\n";
    let rows: String = slopes.iter().map(|slopes| row(slopes)).collect();
    format!("20 24\n{rows}{}", row(&constants))
}

#[test]
fn slope_matrices_become_lines_and_a_coupled_thumb() {
    let (read, form) = read_calibration(&matrix()).unwrap();
    assert_eq!(form, Form::SlopeMatrix);
    let index = read.sensor(Sensor::IndexMcp);
    assert!(
        (index.gain_rad_per_count - 0.015).abs() < 1e-12
            && (index.offset_counts - 80.0).abs() < 1e-9
    );
    let spread = read.sensor(Sensor::MiddleIndexAbduction);
    assert!(
        (spread.gain_rad_per_count - 0.005).abs() < 1e-12
            && (spread.offset_counts - 180.0).abs() < 1e-9
    );
    let raw = RawSensors::from_fn(SensorCount::TwentyTwo, |s| match s {
        Sensor::ThumbRotation => 180,
        Sensor::ThumbAbduction => 115,
        _ => 80,
    });
    let thumb = read.angles(&raw, SensorSet::EMPTY).thumb;
    assert!((thumb.rotation - (0.011 * 180.0 + 0.015 * 115.0 - 3.5)).abs() < 1e-9, "{thumb:?}");
    assert!((thumb.abduction - (-0.017 * 180.0 + 0.013 * 115.0 + 1.5)).abs() < 1e-9, "{thumb:?}");
    let broken = matrix().replacen("0.015000", "fast", 1);
    assert!(
        read_calibration(&broken).unwrap_err().to_string().starts_with("line 3: expected a slope")
    );
    let long = matrix() + "1.0\n";
    assert!(
        read_calibration(&long).unwrap_err().to_string().starts_with("line 23: expected nothing")
    );
    let alike = matrix().replacen("-0.017000", "0.011000", 1).replacen("0.013000", "0.015000", 1);
    assert!(read_calibration(&alike).unwrap_err().to_string().contains("thumb coupling"));
}

#[test]
fn toml_is_still_read() {
    let default = Calibration::default();
    let (read, form) = read_calibration(&toml_text(&default).unwrap()).unwrap();
    assert_eq!((read, form), (default, Form::Toml));
}

proptest! {
    #[test]
    fn every_calibration_comes_back_exactly(calibration in any_calibration()) {
        prop_assume!(check(&calibration).is_ok());
        let text = virtual_hand_text(&calibration, &HEADER);
        prop_assert!(text.lines().all(|line| line.len() <= 80));
        let (read, form) = read_calibration(&text).unwrap();
        prop_assert_eq!(form, Form::VirtualHand);
        prop_assert_eq!(read, calibration);
    }

    #[test]
    fn table_alone_gives_the_angles_up_to_its_printed_digits(
        offsets in prop::array::uniform22(30.0..120.0f64),
        factors in prop::array::uniform22(0.8..1.3f64),
    ) {
        let mut calibration = Calibration::default();
        for line in &mut calibration.sensors {
            line.offset_counts = offsets[line.sensor.index()];
            line.gain_rad_per_count *= factors[line.sensor.index()];
        }
        let text = table_only(&virtual_hand_text(&calibration, &HEADER));
        let (read, _) = read_calibration(&text).unwrap();
        let raw = calibration.raw_from_angles(&JointAngles::fist(), SensorCount::TwentyTwo);
        let [a, b] = [&calibration, &read].map(|c| c.angles(&raw, SensorSet::EMPTY));
        for sensor in Sensor::ALL {
            // Half a count of the offset, half a digit of the gain over the whole range.
            let most = 0.5 * calibration.sensor(sensor).gain_rad_per_count.abs() + 5e-6 * 255.0;
            let off = (sensor_angle(&a, sensor) - sensor_angle(&b, sensor)).abs();
            prop_assert!(off <= most + 1e-9, "{:?} {}", sensor, off);
        }
    }

    #[test]
    fn any_bytes_are_read_or_refused(bytes in prop::collection::vec(any::<u8>(), 0..400)) {
        let _ = read_calibration(&String::from_utf8_lossy(&bytes));
    }

    #[test]
    fn damaged_files_are_sound_or_refused(
        which in 0..5usize,
        damage in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>(), 0..3u8), 1..6),
    ) {
        let texts = [
            written(), table_only(&written()), point_list(), XML.to_owned(), matrix(),
        ];
        let mut bytes = texts[which].clone().into_bytes();
        for (place, byte, kind) in damage {
            let place = place.index(bytes.len());
            match kind {
                0 => bytes[place] = byte,
                1 => bytes.truncate(place.max(1)),
                _ => {
                    let end = (place + usize::from(byte)).min(bytes.len());
                    bytes.drain(place.max(1)..end.max(place.max(1)));
                }
            }
        }
        if let Ok((read, _)) = read_calibration(&String::from_utf8_lossy(&bytes)) {
            prop_assert!(check(&read).is_ok());
            let raw = read.raw_from_angles(&JointAngles::fist(), SensorCount::TwentyTwo);
            let angles = read.angles(&raw, SensorSet::EMPTY).to_array();
            prop_assert!(angles.iter().all(|a| a.is_finite()));
        }
    }
}
