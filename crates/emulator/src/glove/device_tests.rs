//! Tests of the emulated glove: its bytes against the facts, against the parser, and its faults.

use softgrasp_hand::devices::cyberglove::{
    GloveEvent, GloveFaultKind, GloveParser, GloveRecord, RecordOptions, Sensor, encode_record,
};

use super::*;
use crate::FaultSetting;

const COUNTS: [SensorCount; 2] = [SensorCount::Eighteen, SensorCount::TwentyTwo];

/// Sensor values that tell the time: hundredths of a second in base 250, from 1.
fn tagged(count: SensorCount, time_s: f64) -> RawSensors {
    let tag = (time_s * 100.0).round() as usize;
    RawSensors::from_fn(count, |sensor| match sensor {
        Sensor::ThumbRotation => (tag % 250 + 1) as u8,
        Sensor::ThumbMcp => (tag / 250 % 250 + 1) as u8,
        other => other.index() as u8 + 100,
    })
}

fn glove(sensors: SensorCount) -> EmulatedGlove {
    EmulatedGlove::new(EmulatedGloveKind { sensors, ..EmulatedGloveKind::default() })
}

/// All bytes that come within `duration_s` of a command.
fn reply(glove: &mut EmulatedGlove, ask: &[u8], now_s: f64, duration_s: f64) -> Vec<u8> {
    let count = glove.kind().sensors;
    glove.receive(ask, now_s);
    glove.send(now_s + duration_s, |time_s| tagged(count, time_s))
}

#[test]
fn a_poll_is_answered_with_the_documented_record() {
    for (count, length) in [(SensorCount::Eighteen, 20), (SensorCount::TwentyTwo, 24)] {
        let mut glove = glove(count);
        let bytes = reply(&mut glove, b"G", 1.0, 0.01);
        let record = GloveRecord {
            kind: RecordKind::Polled,
            sensors: tagged(count, 1.0),
            timestamp: None,
            status: None,
        };
        assert_eq!(bytes, encode_record(&record));
        assert_eq!((bytes.len(), bytes[0], bytes[length - 1]), (length, b'G', 0));
        // A request is answered once.
        assert_eq!(reply(&mut glove, b"", 2.0, 1.0), b"");
    }
}

#[test]
fn time_stamp_and_status_are_appended_as_asked() {
    let mut glove = glove(SensorCount::TwentyTwo);
    assert_eq!(reply(&mut glove, b"D\x01U\x01L\x01W\x01", 0.0, 0.1), b"D\0U\0L\0W\0");
    let bytes = reply(&mut glove, b"G", 2.0, 0.01);
    assert_eq!(bytes.len(), 30);
    // 230400 ticks are 0x00038400: two zero bytes, sent as stand-ins.
    assert_eq!(bytes[23..], [0x89, 0x01, 0x84, 0x03, 0x01, 0x87, 0]);
    assert_eq!(reply(&mut glove, b"d 0\ru 0\r", 3.0, 0.1), b"d\r\n\0u\r\n\0");
    assert_eq!(reply(&mut glove, b"G", 4.0, 0.01).len(), 24);
}

#[test]
fn queries_are_answered_with_echo_payload_and_nul() {
    let mut glove = EmulatedGlove::new(EmulatedGloveKind {
        sensors: SensorCount::Eighteen,
        hand: Handedness::Left,
        ..EmulatedGloveKind::default()
    });
    let mut now_s = 0.0;
    let mut ask = |bytes: &[u8]| {
        now_s += 1.0;
        reply(&mut glove, bytes, now_s, 0.5)
    };
    assert_eq!(ask(b"?G"), b"?G\x03\0");
    assert_eq!(ask(b"?S"), b"?S\x12\0");
    assert_eq!(ask(b"?N"), b"?N\x12\0");
    assert_eq!(ask(b"?K"), b"?K\x3f\xbb\x7b\0");
    assert_eq!(ask(b"?M"), b"?M\x3f\xbb\x7b\0");
    assert_eq!(ask(b"?P"), b"?P\x81\x98\0\0");
    assert_eq!(ask(b"?R"), b"?R\0\0");
    assert_eq!(ask(b"?T"), b"?T\x04\x80\0\x01\0");
    assert_eq!(ask(b"t 57600 2\r"), b"t\r\n\0");
    assert_eq!(ask(b"?T"), b"?T\xe1\0\0\x02\0");
    for (letter, on) in [(b'W', 0), (b'L', 0), (b'D', 0), (b'F', 1), (b'J', 1), (b'U', 0)] {
        assert_eq!(ask(&[b'?', letter]), [b'?', letter, on, 0]);
    }
    let identity = ask(b"?i");
    assert!(identity.windows(10).any(|w| w == b"CyberGlove") && identity.ends_with(b"\r\n\0"));
    assert!(ask(b"?v").starts_with(b"?v") && ask(b"?V").ends_with(b"\r\n\0"));
    assert_eq!(ask(b"l ?\r"), b"l 0\r\n\0");
    assert_eq!(ask(b"Z"), b"e?\0");
    assert_eq!(ask(b"?z"), b"e?\0");
    assert_eq!(ask(b"u 1 2\r"), b"en\0");
    assert_eq!(ask(b"B\x04\t"), b"B\0\t\0");
}

#[test]
fn restart_takes_its_time_and_forgets_the_settings() {
    let mut glove = glove(SensorCount::TwentyTwo);
    let _ = reply(&mut glove, b"D\x01", 0.0, 0.1);
    assert_eq!(reply(&mut glove, b"\x12", 1.0, 1.74), b"");
    assert_eq!(reply(&mut glove, b"?S", 2.74, 0.0), b"", "it does not listen");
    assert_eq!(reply(&mut glove, b"", 2.76, 0.0), b"\x12\r\n\0");
    assert_eq!(reply(&mut glove, b"?D", 3.0, 0.1), b"?D\0\0");
}

#[test]
fn a_stream_has_the_rate_asked_for_until_it_is_stopped() {
    for (words, rate) in [("1152 1", 100), ("1920 1", 60), ("11520 1", 10), ("57600 2", 1)] {
        let mut glove = glove(SensorCount::TwentyTwo);
        let _ = reply(&mut glove, format!("t {words}\r").as_bytes(), 0.0, 0.5);
        let bytes = reply(&mut glove, b"S", 1.0, 4.0005 + 0.0025);
        assert_eq!(bytes.len(), 4 * rate * 24, "{words}");
        assert!(bytes.chunks(24).all(|record| record[0] == b'S' && record[23] == 0));
        assert_eq!(reply(&mut glove, b"\x03", 5.004, 0.5), b"\x03\0");
        assert_eq!(reply(&mut glove, b"", 10.0, 0.0), b"");
    }
}

#[test]
fn a_stream_that_is_too_fast_says_so_and_keeps_its_values() {
    let mut glove = glove(SensorCount::TwentyTwo);
    let _ = reply(&mut glove, b"t 576 1\r", 0.0, 0.5);
    let bytes = reply(&mut glove, b"S", 1.0, 1.004);
    let mut parser = GloveParser::new(SensorCount::TwentyTwo, RecordOptions::default());
    let (mut records, mut late) = (0, 0);
    parser.feed_all(&bytes, |event| match event {
        GloveEvent::Record(_) => records += 1,
        GloveEvent::Fault(fault) => late += usize::from(fault.bytes_skipped == 0),
    });
    assert_eq!((records, late), (100, 100));
}

#[test]
fn lines_of_text_are_those_of_a_real_glove() {
    let values =
        [1, 76, 93, 113, 89, 42, 20, 77, 98, 106, 117, 81, 62, 23, 52, 60, 34, 68, 57, 254, 92, 26];
    let raw = RawSensors::try_new(SensorCount::TwentyTwo, &values).unwrap();
    let mut glove = glove(SensorCount::TwentyTwo);
    glove.receive(b"g\r", 0.0);
    let line = b"g 1 76 93 113 89 42 20 77 98 106 117 81 62 23 52 60 34 68 57 254 92 26\r\n\0";
    assert_eq!(glove.send(1.0, |_| raw), line);
}

#[test]
fn every_record_of_every_format_passes_the_parser_in_order() {
    for count in COUNTS {
        for (timestamp, status) in [(false, false), (true, false), (false, true), (true, true)] {
            let mut glove = glove(count);
            let on = [b'D', u8::from(timestamp), b'U', u8::from(status)];
            let _ = reply(&mut glove, &on, 0.0, 0.5);
            glove.receive(b"S", 1.0);
            let mut parser = GloveParser::new(count, RecordOptions { timestamp, status });
            let mut records = Vec::new();
            // Taken in uneven pieces, as a reader does.
            for step in 1..=3000 {
                let bytes = glove.send(1.0 + 0.0013 * f64::from(step), |t| tagged(count, t));
                parser.feed_all(&bytes, |event| match event {
                    GloveEvent::Record(record) => records.push(record),
                    GloveEvent::Fault(fault) => panic!("{fault}"),
                });
            }
            assert_eq!(records.len(), 389);
            for (i, record) in records.iter().enumerate() {
                let time_s = 1.01 + 0.01 * i as f64;
                assert_eq!(record.sensors, tagged(count, time_s));
                let ticks = record.timestamp.map(|ticks| (ticks.seconds() - time_s).abs() < 1e-4);
                assert_eq!(ticks, timestamp.then_some(true));
            }
        }
    }
}

/// Runs a faulty stream of 20 s; returns the records whose values were sent, and the faults.
fn faulty(fault: Fault, rate: f64) -> (Vec<usize>, Vec<GloveFaultKind>) {
    let count = SensorCount::TwentyTwo;
    let faults = vec![FaultSetting { fault, rate }];
    let mut glove = EmulatedGlove::new(EmulatedGloveKind { faults, ..Default::default() });
    glove.receive(b"S", 0.0);
    let mut parser = GloveParser::new(count, RecordOptions::default());
    let (mut tags, mut faults) = (Vec::new(), Vec::new());
    for step in 0..=20_000 {
        let now_s = f64::from(step) * 1e-3;
        let bytes = glove.send(now_s, |time_s| tagged(count, time_s));
        parser.feed_all(&bytes, |event| match event {
            GloveEvent::Record(record) => {
                let values = record.sensors.as_slice();
                let tag = usize::from(values[0]) - 1 + 250 * (usize::from(values[1]) - 1);
                // Noise may form a record of its own; it does not carry the right values.
                if fault == Fault::DeadSensor || record.sensors == tagged(count, tag as f64 / 100.0)
                {
                    tags.push(tag);
                }
            }
            GloveEvent::Fault(fault) => faults.push(fault.kind),
        });
    }
    (tags, faults)
}

#[test]
fn each_fault_costs_some_records_and_the_rest_arrive_in_order() {
    for (fault, rate) in [
        (Fault::ZeroByte, 0.05),
        (Fault::Truncated, 0.05),
        (Fault::Noise, 0.05),
        (Fault::NotPluggedIn, 0.05),
        (Fault::TooFast, 0.05),
        (Fault::Duplicate, 0.05),
        (Fault::Burst, 0.02),
        (Fault::Silence, 0.002),
    ] {
        let (tags, faults) = faulty(fault, rate);
        let ordered = tags.windows(2).all(|pair| pair[0] <= pair[1]);
        assert!(ordered && *tags.last().unwrap() > 1750, "{fault}: {:?}", tags.last());
        let mut distinct = tags.clone();
        distinct.dedup();
        match fault {
            Fault::TooFast => {
                // The last is still on the line.
                assert_eq!(distinct.len(), 1999);
                assert!((50..200).contains(&faults.len()));
            }
            Fault::Duplicate => {
                assert!(distinct.len() == 1999 && tags.len() > 2050 && faults.is_empty());
            }
            Fault::Burst => assert!(tags.len() > 1980 && faults.is_empty()),
            Fault::Silence => assert!((500..1900).contains(&tags.len()) && faults.is_empty()),
            _ => {
                assert!((1700..1990).contains(&tags.len()), "{fault}: {}", tags.len());
                assert!(!faults.is_empty(), "{fault}");
            }
        }
    }
}

#[test]
fn dead_sensors_stay_at_an_end_of_their_range() {
    let faults = vec![FaultSetting { fault: Fault::DeadSensor, rate: 0.1 }];
    let mut glove = EmulatedGlove::new(EmulatedGloveKind { faults, ..Default::default() });
    let mut health = softgrasp_hand::devices::cyberglove::SensorHealth::default();
    let mut parser = GloveParser::new(SensorCount::TwentyTwo, RecordOptions::default());
    glove.receive(b"S", 0.0);
    let bytes = glove.send(4.5, |time_s| {
        let value = 100 + ((time_s * 100.0) as u8 % 50);
        RawSensors::from_fn(SensorCount::TwentyTwo, |_| value)
    });
    parser.feed_all(&bytes, |event| {
        if let GloveEvent::Record(record) = event {
            health.observe(&record.sensors);
        }
    });
    assert_eq!(health.dead().iter().count(), 2);
    assert_eq!(health.dead(), glove.dead);
}

#[test]
fn any_bytes_from_a_client_are_survived() {
    let mut chance = crate::chance::Chance::new(11);
    let mut glove = glove(SensorCount::Eighteen);
    for step in 0..20_000 {
        let bytes: Vec<u8> = (0..chance.below(12)).map(|_| chance.byte()).collect();
        let now_s = f64::from(step) * 0.01;
        glove.receive(&bytes, now_s);
        assert!(glove.inbox.len() < 100);
        let _ = glove.send(now_s, |time_s| tagged(SensorCount::Eighteen, time_s));
    }
    // An argument or a line that was begun is ended first, and a restart waited for.
    glove.receive(b"\r\0\0\0\0\x03", 210.0);
    let _ = glove.send(220.0, |time_s| tagged(SensorCount::Eighteen, time_s));
    assert_eq!(reply(&mut glove, b"?S", 221.0, 1.0), b"?S\x12\0");
}
