//! Tests of the emulated tracker: its bytes against the facts, against the parser, and its faults.

use nalgebra::{Translation3, UnitQuaternion};
use softgrasp_hand::devices::fastrak::{
    FastrakEvent, FastrakFormat, FastrakParser, FastrakRecord, OutputList,
};

use super::*;
use crate::FaultSetting;

/// A pose that tells the time: 0.1 mm to the right for each hundredth of a second, 40 cm forward.
fn tagged(time_s: f64) -> Isometry3<f64> {
    let tag = (time_s * 120.0).round();
    Isometry3::from_parts(
        Translation3::new(1e-4 * tag, 0.05, -0.4),
        UnitQuaternion::from_euler_angles(0.1, 0.2, 0.3),
    )
}

fn tag_of(record: &FastrakRecord) -> i64 {
    (record.world_from_receiver().translation.x * 1e4).round() as i64
}

fn tracker(plugged: [bool; 4]) -> EmulatedTracker {
    EmulatedTracker::new(EmulatedTrackerKind { plugged, ..EmulatedTrackerKind::default() })
}

const ONE: [bool; 4] = [true, false, false, false];

fn reply(tracker: &mut EmulatedTracker, ask: &[u8], now_s: f64, duration_s: f64) -> Vec<u8> {
    tracker.receive(ask, now_s);
    let steps = (duration_s / 0.5).ceil().max(1.0) as u32;
    let taken = (1..=steps).map(|step| {
        let share = f64::from(step) / f64::from(steps);
        tracker.send(now_s + share * duration_s, |_, time_s| tagged(time_s))
    });
    taken.collect::<Vec<_>>().concat()
}

fn worked_example() -> Isometry3<f64> {
    let (azimuth, elevation, roll) = (30f64, 20f64, 10f64);
    let rotation = UnitQuaternion::from_euler_angles(
        roll.to_radians(),
        elevation.to_radians(),
        azimuth.to_radians(),
    );
    let inches = Vector3::new(10.25, -3.5, 22.0) * 0.0254;
    world_from_transmitter() * Isometry3::from_parts(inches.into(), rotation)
}

#[test]
fn the_worked_example_comes_out_byte_for_byte() {
    let mut tracker = tracker(ONE);
    tracker.receive(b"P", 0.0);
    let ascii = tracker.send(0.1, |_, _| worked_example());
    assert_eq!(ascii, b"01   10.25  -3.50  22.00  30.00  20.00  10.00\r\n");
    tracker.receive(b"fP", 0.2);
    let binary = tracker.send(0.3, |_, _| worked_example());
    assert_eq!(binary.len(), 29);
    assert_eq!(
        binary[..15],
        [0x30, 0x31, 0x20, 0, 0, 0x24, 0x41, 0, 0, 0x60, 0xc0, 0, 0, 0xb0, 0x41]
    );
    tracker.receive(b"O1,2,11,0\rP", 0.4);
    assert_eq!(tracker.send(0.5, |_, _| worked_example()).len(), 32);
}

#[test]
fn active_stations_share_120_records_per_second() {
    for (plugged, each) in
        [(ONE, 120), ([true, true, false, false], 60), ([true, true, true, true], 30)]
    {
        let mut tracker = tracker(plugged);
        let bytes = reply(&mut tracker, b"fC", 0.0, 10.0 + 0.0028);
        let records: Vec<&[u8]> = bytes.chunks(29).collect();
        assert_eq!(records.len(), 1200);
        for station in 0..4 {
            let count = records.iter().filter(|r| r[1] == b'1' + station).count();
            let expected = if plugged[usize::from(station)] { 10 * each } else { 0 };
            assert_eq!(count, expected);
        }
        assert_eq!(reply(&mut tracker, b"c", 10.0028, 0.5), b"");
    }
}

#[test]
fn a_poll_sends_each_active_station_in_numeric_order() {
    let mut tracker = tracker([true, false, true, false]);
    let bytes = reply(&mut tracker, b"P", 0.0, 0.1);
    assert_eq!((bytes.len(), &bytes[..2], &bytes[47..49]), (94, &b"01"[..], &b"03"[..]));
    let _ = reply(&mut tracker, b"l3,0\r", 1.0, 0.1);
    assert_eq!(reply(&mut tracker, b"P", 2.0, 0.1).len(), 47);
    assert_eq!(reply(&mut tracker, b"l1\r", 3.0, 0.1), b"21l1000\r\n");
}

#[test]
fn status_and_errors_are_the_documented_records() {
    let mut tracker = tracker(ONE);
    let status = reply(&mut tracker, b"S", 0.0, 0.1);
    assert_eq!((status.len(), &status[..6]), (55, &b"21S3F0"[..]));
    let _ = reply(&mut tracker, b"fuDC", 1.0, 0.0);
    tracker.receive(b"c", 1.0);
    tracker.receive(b"C", 1.001);
    let status = reply(&mut tracker, b"S", 1.002, 0.006);
    assert_eq!(&status[..6], b"21S3FF");
    tracker.receive(b"c", 1.008);
    let _ = tracker.send(1.1, |_, time_s| tagged(time_s));
    for (wrong, code) in [(&b"z"[..], -99), (b"O9,2\r", -3), (b"H,1\r", -1), (b"O1,a\r", -2)] {
        let bytes = reply(&mut tracker, wrong, 2.0, 0.1);
        let text = String::from_utf8(bytes).unwrap();
        let letter = char::from(wrong[0]);
        assert!(text.starts_with(&format!("2 E*ERROR*{letter}*ERROR* EC {code}*PS")), "{text}");
        assert!(text.ends_with("\r\n"));
    }
    // The parser takes all of them for replies.
    let mut parser = FastrakParser::new(FORMATS[0]);
    let bytes = [&reply(&mut tracker, b"S", 3.0, 0.1)[..], &reply(&mut tracker, b"z", 4.0, 0.1)];
    parser.feed_all(&bytes.concat(), |event| assert!(matches!(event, FastrakEvent::Reply(_))));
}

#[test]
fn suspended_output_waits_and_saved_settings_come_back() {
    let mut tracker = tracker(ONE);
    assert_eq!(reply(&mut tracker, b"\x13P", 0.0, 1.0), b"");
    assert_eq!(reply(&mut tracker, b"\x11", 2.0, 1.0).len(), 47);
    let _ = reply(&mut tracker, b"fu\x0BFU", 4.0, 0.1);
    assert_eq!(reply(&mut tracker, b"S", 5.0, 0.1)[5], b'0');
    assert_eq!(reply(&mut tracker, b"\x19S", 6.0, 9.0), b"", "it does not listen");
    assert_eq!(reply(&mut tracker, b"S", 16.1, 0.1)[5], b'3');
    let _ = reply(&mut tracker, b"W", 17.0, 0.1);
    assert_eq!(reply(&mut tracker, b"S", 18.0, 0.1)[5], b'0');
}

#[test]
fn boresight_makes_the_present_attitude_the_zero() {
    let mut tracker = tracker(ONE);
    tracker.receive(b"B1\rP", 0.0);
    let bytes = tracker.send(0.1, |_, _| worked_example());
    let angles = String::from_utf8(bytes[24..45].to_vec()).unwrap();
    let angles: Vec<f64> = angles.split_whitespace().map(|text| text.parse().unwrap()).collect();
    assert_eq!(angles, [0.0; 3]);
    tracker.receive(b"b1\rP", 0.2);
    let bytes = tracker.send(0.3, |_, _| worked_example());
    assert_eq!(&bytes[24..31], b"  30.00");
}

#[test]
fn a_receiver_in_the_other_hemisphere_is_reported_at_the_opposite_place() {
    let behind = Isometry3::translation(0.1, 0.0, 0.4);
    let x = |bytes: &[u8]| String::from_utf8(bytes[3..10].to_vec()).unwrap().trim().to_owned();
    let mut tracker = tracker(ONE);
    tracker.receive(b"uP", 0.0);
    assert_eq!(x(&tracker.send(0.1, |_, _| behind)), "40.00");
    tracker.receive(b"H1,-1,0,0\rP", 0.2);
    assert_eq!(x(&tracker.send(0.3, |_, _| behind)), "-40.00");
    // Zero follows the receiver from the side it was on.
    tracker.receive(b"H1,0,0,0\r", 0.4);
    for (x_cm, expected) in [(-40.0, "-40.00"), (-5.0, "-5.00"), (5.0, "5.00"), (40.0, "40.00")] {
        tracker.receive(b"P", 0.5);
        let there = Isometry3::translation(0.3, 0.0, -0.01 * x_cm);
        assert_eq!(x(&tracker.send(0.6, |_, _| there)), expected);
    }
}

const FORMATS: [FastrakFormat; 4] = [
    format(Encoding::Ascii, OutputList::PositionEuler, LengthUnit::Inches),
    format(Encoding::Ascii, OutputList::PositionQuaternion, LengthUnit::Centimetres),
    format(Encoding::Binary, OutputList::PositionEuler, LengthUnit::Centimetres),
    format(Encoding::Binary, OutputList::PositionQuaternion, LengthUnit::Centimetres),
];

const fn format(encoding: Encoding, output: OutputList, units: LengthUnit) -> FastrakFormat {
    FastrakFormat { encoding, output, units }
}

fn set_up(tracker: &mut EmulatedTracker, format: FastrakFormat) {
    let encoding = if format.encoding == Encoding::Binary { "f" } else { "F" };
    let units = if format.units == LengthUnit::Centimetres { "u" } else { "U" };
    let list = if format.output == OutputList::PositionEuler { "2,4,1" } else { "2,11,1" };
    tracker.receive(format!("O1,{list}\r{encoding}{units}").as_bytes(), 0.0);
}

#[test]
fn every_record_of_every_format_passes_the_parser_in_order() {
    for format in FORMATS {
        let mut tracker = tracker(ONE);
        set_up(&mut tracker, format);
        tracker.receive(b"C", 0.0);
        let mut parser = FastrakParser::new(format);
        let mut tags = Vec::new();
        for step in 1..=3000 {
            let bytes = tracker.send(0.0013 * f64::from(step), |_, time_s| tagged(time_s));
            parser.feed_all(&bytes, |event| match event {
                FastrakEvent::Record(record) => tags.push(tag_of(&record)),
                other => panic!("{other:?}"),
            });
        }
        let count = tags.len() as i64;
        // Inches in text have a step of 0.25 mm, two and a half tags.
        let off = if format.units == LengthUnit::Inches { 2 } else { 0 };
        assert!((466..=468).contains(&count), "{count}");
        assert!(
            tags.iter().zip(1..).all(|(tag, i): (&i64, i64)| (tag - i).abs() <= off),
            "{format:?}"
        );
    }
}

/// Runs 20 s of a faulty tracker; tags of records at their true place, and everything else.
fn faulty(fault: Fault, rate: f64) -> (Vec<i64>, Vec<FastrakEvent>) {
    let faults = vec![FaultSetting { fault, rate }];
    let mut tracker = EmulatedTracker::new(EmulatedTrackerKind { faults, ..Default::default() });
    set_up(&mut tracker, FORMATS[3]);
    tracker.receive(b"C", 0.0);
    let mut parser = FastrakParser::new(FORMATS[3]);
    let (mut tags, mut others) = (Vec::new(), Vec::new());
    for step in 1..=20_000 {
        let bytes = tracker.send(1e-3 * f64::from(step), |_, time_s| tagged(time_s));
        parser.feed_all(&bytes, |event| match event {
            FastrakEvent::Record(record)
                if record.error.is_none()
                    && (record.world_from_receiver().translation.z + 0.4).abs() < 1e-5 =>
            {
                tags.push(tag_of(&record));
            }
            other => others.push(other),
        });
    }
    (tags, others)
}

#[test]
fn each_fault_costs_some_records_and_the_rest_arrive_in_order() {
    for (fault, rate) in [
        (Fault::HemisphereFlip, 0.005),
        (Fault::StationError, 0.05),
        (Fault::ErrorRecord, 0.05),
        (Fault::Truncated, 0.05),
        (Fault::Noise, 0.05),
        (Fault::Duplicate, 0.05),
        (Fault::Burst, 0.02),
        (Fault::Silence, 0.002),
    ] {
        let (tags, others) = faulty(fault, rate);
        let ordered = tags.windows(2).all(|pair| pair[0] <= pair[1]);
        assert!(ordered && *tags.last().unwrap() > 2200, "{fault}: {:?}", tags.last());
        let mut distinct = tags.clone();
        distinct.dedup();
        let flips = others.iter().filter(|e| matches!(e, FastrakEvent::HemisphereFlip(_))).count();
        let replies = others.iter().filter(|e| matches!(e, FastrakEvent::Reply(_))).count();
        match fault {
            Fault::HemisphereFlip => assert!(flips >= 4 && tags.len() > 1000, "{flips}"),
            Fault::ErrorRecord => assert!(replies > 60 && distinct.len() > 2390),
            Fault::Duplicate => assert!(distinct.len() > 2390 && tags.len() > 2450),
            Fault::Burst => assert!(tags.len() > 2370 && others.is_empty()),
            Fault::Silence => assert!((600..2300).contains(&tags.len()) && others.is_empty()),
            _ => {
                assert!((2000..2395).contains(&tags.len()), "{fault}: {}", tags.len());
                assert!(!others.is_empty(), "{fault}");
            }
        }
    }
}

#[test]
fn a_slow_line_loses_records_and_does_not_fall_behind() {
    let kind = EmulatedTrackerKind { baud: 9600, ..EmulatedTrackerKind::default() };
    let mut tracker = EmulatedTracker::new(kind);
    let bytes = reply(&mut tracker, b"C", 0.0, 10.0);
    // 20 records of 47 bytes a second is what the line can carry.
    assert!((190..=205).contains(&(bytes.len() / 47)), "{}", bytes.len() / 47);
    assert!(tracker.line.waiting() <= 3 * 47);
}

#[test]
fn any_bytes_from_a_client_are_survived() {
    let mut chance = crate::chance::Chance::new(12);
    let kind = EmulatedTrackerKind { restart_s: 0.1, ..EmulatedTrackerKind::default() };
    let mut tracker = EmulatedTracker::new(kind);
    for step in 0..20_000 {
        let bytes: Vec<u8> = (0..chance.below(12)).map(|_| chance.byte()).collect();
        let now_s = f64::from(step) * 0.01;
        tracker.receive(&bytes, now_s);
        assert!(tracker.inbox.len() < 130);
        let _ = tracker.send(now_s, |_, time_s| tagged(time_s));
    }
    tracker.receive(b"\rc\x11", 210.0);
    let _ = tracker.send(220.0, |_, time_s| tagged(time_s));
    tracker.receive(b"W", 220.0);
    assert_eq!(reply(&mut tracker, b"S", 221.0, 1.0).len(), 55);
}
