//! Tests of the glove parser: any split, garbage, faults, random bytes.

use proptest::prelude::*;

use super::*;
use crate::devices::cyberglove::{GloveStatus, GloveTicks, RawSensors, RecordKind, encode_record};

fn any_format() -> impl Strategy<Value = (SensorCount, RecordOptions)> {
    let count = prop_oneof![Just(SensorCount::Eighteen), Just(SensorCount::TwentyTwo)];
    (count, any::<bool>(), any::<bool>())
        .prop_map(|(count, timestamp, status)| (count, RecordOptions { timestamp, status }))
}

fn any_record(
    (count, options): (SensorCount, RecordOptions),
) -> impl Strategy<Value = GloveRecord> {
    let values = prop::collection::vec(1u8..=255, count.number());
    (values, any::<u32>(), any::<[bool; 3]>(), any::<bool>()).prop_map(
        move |(values, ticks, [plugged_in, switch_on, light_on], polled)| GloveRecord {
            kind: if polled { RecordKind::Polled } else { RecordKind::Streamed },
            sensors: RawSensors::try_new(count, &values).unwrap(),
            timestamp: options.timestamp.then_some(GloveTicks(ticks)),
            status: options.status.then_some(GloveStatus { plugged_in, switch_on, light_on }),
        },
    )
}

type Stream = ((SensorCount, RecordOptions), Vec<GloveRecord>);

fn any_stream() -> impl Strategy<Value = Stream> {
    any_format()
        .prop_flat_map(|format| (Just(format), prop::collection::vec(any_record(format), 1..12)))
}

/// Events of `bytes` fed in pieces of the given sizes, the last size repeated.
fn events_in_pieces(
    (count, options): (SensorCount, RecordOptions),
    bytes: &[u8],
    sizes: &[usize],
) -> Vec<GloveEvent> {
    let mut parser = GloveParser::new(count, options);
    let mut events = Vec::new();
    let (mut rest, mut turn) = (bytes, 0);
    while !rest.is_empty() {
        let size = sizes[turn.min(sizes.len() - 1)].clamp(1, rest.len());
        parser.feed_all(&rest[..size], |event| events.push(event));
        rest = &rest[size..];
        turn += 1;
    }
    events
}

fn records(events: &[GloveEvent]) -> Vec<GloveRecord> {
    events
        .iter()
        .filter_map(|event| match event {
            GloveEvent::Record(record) => Some(*record),
            GloveEvent::Fault(_) => None,
        })
        .collect()
}

fn bytes_skipped(events: &[GloveEvent]) -> usize {
    events
        .iter()
        .map(|event| match event {
            GloveEvent::Record(_) => 0,
            GloveEvent::Fault(fault) => fault.bytes_skipped,
        })
        .sum()
}

fn is_subsequence<T: PartialEq>(wanted: &[T], found: &[T]) -> bool {
    let mut found = found.iter();
    wanted.iter().all(|w| found.any(|f| f == w))
}

/// Bytes a random generator would hardly hit: record letters, error texts, NULs.
fn noise(length: std::ops::Range<usize>) -> impl Strategy<Value = Vec<u8>> {
    let byte = prop_oneof![4 => any::<u8>(), 1 => Just(0), 1 => Just(b'G'), 1 => Just(b'e')];
    prop::collection::vec(byte, length)
}

proptest! {
    #[test]
    fn any_split_of_a_stream_gives_the_same_records(
        (format, sent) in any_stream(), sizes in prop::collection::vec(1usize..40, 1..20),
    ) {
        let bytes: Vec<u8> = sent.iter().flat_map(encode_record).collect();
        let expected: Vec<_> = sent.into_iter().map(GloveEvent::Record).collect();
        prop_assert_eq!(events_in_pieces(format, &bytes, &sizes), expected);
    }

    #[test]
    fn any_split_of_any_bytes_gives_the_same_events(
        format in any_format(), bytes in noise(0..6000),
        sizes in prop::collection::vec(1usize..200, 1..20),
    ) {
        let whole = events_in_pieces(format, &bytes, &[bytes.len()]);
        prop_assert_eq!(events_in_pieces(format, &bytes, &sizes), whole);
    }

    #[test]
    fn garbage_between_records_costs_at_most_the_next_record(
        (format, sent) in any_stream(), garbage in noise(1..100), place in any::<prop::sample::Index>(),
    ) {
        let place = place.index(sent.len());
        let mut bytes = Vec::new();
        for (i, record) in sent.iter().enumerate() {
            if i == place {
                bytes.extend_from_slice(&garbage);
            }
            bytes.extend(encode_record(record));
        }
        let found = records(&events_in_pieces(format, &bytes, &[17]));
        let mut untouched = sent;
        untouched.remove(place);
        prop_assert!(is_subsequence(&untouched, &found));
    }

    #[test]
    fn a_lost_byte_costs_at_most_two_records(
        (format, sent) in any_stream(), place in any::<prop::sample::Index>(),
    ) {
        let mut bytes: Vec<u8> = sent.iter().flat_map(encode_record).collect();
        bytes.remove(place.index(bytes.len()));
        let found = records(&events_in_pieces(format, &bytes, &[5]));
        prop_assert!(is_subsequence(&found, &sent), "nothing is made up");
        prop_assert!(found.len() + 2 >= sent.len());
    }

    #[test]
    fn every_byte_is_accounted_for_and_memory_stays_bounded(
        format in any_format(), bytes in noise(0..9000),
    ) {
        let (count, options) = format;
        let mut parser = GloveParser::new(count, options);
        let mut events = Vec::new();
        parser.feed_all(&bytes, |event| events.push(event));
        // A record with "es" behind it is consumed, not skipped, and its complaint counts nothing.
        let per_record = options.frame_length(count) + 1;
        let late = events.iter().filter(|e| {
            matches!(e, GloveEvent::Fault(GloveFault { bytes_skipped: 0, .. }))
        }).count();
        let accounted = records(&events).len() * per_record + 2 * late + bytes_skipped(&events);
        let held = parser.inbox.waiting().len() + parser.overlong.unwrap_or(0);
        prop_assert_eq!(accounted + held, bytes.len());
        prop_assert!(parser.inbox.waiting().len() <= parser.longest());
    }
}

const PLAIN: (SensorCount, RecordOptions) =
    (SensorCount::TwentyTwo, RecordOptions { timestamp: false, status: false });

fn faults_of(bytes: &[u8]) -> Vec<(GloveFaultKind, usize)> {
    events_in_pieces(PLAIN, bytes, &[1])
        .into_iter()
        .filter_map(|event| match event {
            GloveEvent::Record(_) => None,
            GloveEvent::Fault(fault) => Some((fault.kind, fault.bytes_skipped)),
        })
        .collect()
}

fn good_record() -> Vec<u8> {
    let mut bytes = vec![b'G'];
    bytes.extend([76, 93, 113, 89, 42, 20, 77, 98, 106, 117, 81]);
    bytes.extend([62, 23, 52, 60, 34, 68, 57, 254, 92, 26, 1]);
    bytes.push(0);
    bytes
}

#[test]
fn every_error_text_is_recognised_alone() {
    let expected = [
        ("e?", GloveError::UnknownCommand),
        ("en", GloveError::TooManyNumbers),
        ("ey", GloveError::SyncTooFast),
        ("eg", GloveError::NotPluggedIn),
        ("es", GloveError::SamplingTooFast),
    ];
    for (text, error) in expected {
        let bytes = format!("{text}\0G{text}\0");
        let kind = GloveFaultKind::Device(error);
        assert_eq!(faults_of(bytes.as_bytes()), [(kind, 3), (kind, 4)]);
    }
}

#[test]
fn unplugged_glove_inside_a_record_is_a_fault_without_values() {
    let mut bytes = good_record();
    bytes.splice(23..23, *b"eg");
    let fault = (GloveFaultKind::Device(GloveError::NotPluggedIn), 26);
    assert_eq!(faults_of(&bytes), [fault]);
    assert!(records(&events_in_pieces(PLAIN, &bytes, &[3])).is_empty());
}

#[test]
fn too_fast_sampling_inside_a_record_keeps_its_values() {
    let mut bytes = good_record();
    bytes.splice(23..23, *b"es");
    let fault = (GloveFaultKind::Device(GloveError::SamplingTooFast), 0);
    assert_eq!(faults_of(&bytes), [fault]);
    let kept = records(&events_in_pieces(PLAIN, &bytes, &[3]));
    assert_eq!(kept[0].sensors.as_slice(), &good_record()[1..23]);
}

#[test]
fn a_zero_among_the_sensors_costs_that_record_only() {
    let mut bytes = good_record();
    bytes[9] = 0;
    bytes.extend(good_record());
    let short = |got| GloveFaultKind::WrongLength { got, expected: 23 };
    assert_eq!(faults_of(&bytes), [(short(9), 10), (short(13), 14)]);
    assert_eq!(records(&events_in_pieces(PLAIN, &bytes, &[7])).len(), 1);
}

#[test]
fn a_line_without_any_nul_is_reported_again_and_again() {
    let faults = faults_of(&[0x55; 5000]);
    assert_eq!(faults, [(GloveFaultKind::NoTerminator, REPORT_EVERY); 4]);
}

#[test]
fn wrong_letter_and_wrong_status_are_named() {
    let mut bytes = good_record();
    bytes[0] = b'g';
    assert_eq!(faults_of(&bytes), [(GloveFaultKind::UnknownStart { byte: b'g' }, 24)]);
    let mut bytes = good_record();
    bytes.insert(23, 0x05);
    let options = RecordOptions { status: true, timestamp: false };
    let events = events_in_pieces((SensorCount::TwentyTwo, options), &bytes, &[24]);
    let kind = GloveFaultKind::BadStatus { byte: 0x05 };
    assert_eq!(events, [GloveEvent::Fault(GloveFault { kind, bytes_skipped: 25 })]);
}

fn line_events(bytes: &[u8], size: usize) -> Vec<GloveEvent> {
    let mut parser = GloveParser::of_lines(SensorCount::TwentyTwo);
    let mut events = Vec::new();
    bytes.chunks(size).for_each(|piece| parser.feed_all(piece, |event| events.push(event)));
    events
}

#[test]
fn a_line_of_a_real_glove_is_read() {
    // Published by an owner of a glove: palm arch at the end of its range.
    let line = b"g 1 76 93 113 89 42 20 77 98 106 117 81 62 23 52 60 34 68 57 254 92 26\r\n\0";
    for size in [1, 7, 200] {
        let events = line_events(&line.repeat(2), size);
        let [GloveEvent::Record(record), GloveEvent::Record(again)] = events[..] else {
            panic!("{events:?}")
        };
        assert_eq!((record.kind, record), (RecordKind::Polled, again));
        assert_eq!(&record.sensors.as_slice()[..3], [1, 76, 93]);
        assert_eq!(record.sensors.as_slice()[19..], [254, 92, 26]);
        assert_eq!(crate::devices::cyberglove::encode_line(&record), line);
    }
}

#[test]
fn damaged_lines_cost_themselves_only() {
    let good = b"s 1 76 93 113 89 42 20 77 98 106 117 81 62 23 52 60 34 68 57 254 92 26\r\n\0";
    let kinds = |bytes: &[u8]| -> Vec<GloveFaultKind> {
        let events = line_events(&[bytes, good].concat(), 5);
        assert!(matches!(events.last(), Some(GloveEvent::Record(_))), "{events:?}");
        let fault = |event: &GloveEvent| match event {
            GloveEvent::Fault(fault) => Some(fault.kind),
            GloveEvent::Record(_) => None,
        };
        events.iter().filter_map(fault).collect()
    };
    let numbers = |got| GloveFaultKind::WrongNumbers { got, expected: 22 };
    assert_eq!(kinds(b"g 1 2 3\r\n\0"), [numbers(3)]);
    assert_eq!(kinds(&[&b"g"[..], &b" 0".repeat(22), b"\r\n\0"].concat()), [numbers(22)]);
    assert_eq!(kinds(&[&b"g"[..], &b" 256".repeat(22), b"\r\n\0"].concat()), [numbers(22)]);
    assert_eq!(kinds(b"G 1\0"), [GloveFaultKind::UnknownStart { byte: b'G' }]);
    assert_eq!(kinds(b"e?\0"), [GloveFaultKind::Device(GloveError::UnknownCommand)]);
    let unplugged = [&b"g"[..], &b" 9".repeat(22), b"eg\r\n\0"].concat();
    assert_eq!(kinds(&unplugged), [GloveFaultKind::Device(GloveError::NotPluggedIn)]);
    assert_eq!(kinds(&[&[b'g'; 300][..], b"\0"].concat()), [GloveFaultKind::NoTerminator]);
    let late = [&b"g"[..], &b" 9".repeat(22), b"es\r\n\0"].concat();
    assert_eq!(line_events(&late, 9).len(), 2);
}
