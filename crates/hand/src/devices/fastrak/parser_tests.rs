//! Tests of the tracker parser: any split, garbage, traps inside floats, random bytes.

use proptest::prelude::*;

use super::*;
use crate::devices::fastrak::{Attitude, Encoding, LengthUnit, OutputList, Station, encode_record};

const FORMATS: [(Encoding, OutputList); 4] = [
    (Encoding::Ascii, OutputList::PositionEuler),
    (Encoding::Ascii, OutputList::PositionQuaternion),
    (Encoding::Binary, OutputList::PositionEuler),
    (Encoding::Binary, OutputList::PositionQuaternion),
];

fn any_format() -> impl Strategy<Value = FastrakFormat> {
    (prop::sample::select(FORMATS.to_vec()), any::<bool>()).prop_map(
        |((encoding, output), inches)| {
            let units = if inches { LengthUnit::Inches } else { LengthUnit::Centimetres };
            FastrakFormat { encoding, output, units }
        },
    )
}

/// Records whose numbers are exact in the format, with the traps the facts warn of: full-width
/// columns that touch, and floats that contain `'0'`, `'1'`, blank, CR and LF.
fn any_record(format: FastrakFormat) -> impl Strategy<Value = FastrakRecord> {
    let trap = f64::from(f32::from_le_bytes([0x0d, 0x0a, 0x30, 0x31]));
    let nested = f64::from(f32::from_le_bytes([0x20, 0x30, 0x31, 0x42]));
    let hundredths = (-99_999i32..100_000).prop_map(|n| f64::from(n) / 100.0);
    let number = match format.encoding {
        Encoding::Ascii => prop_oneof![3 => hundredths, 1 => Just(-100.25)].boxed(),
        Encoding::Binary => prop_oneof![
            3 => hundredths.prop_map(|v| f64::from(v as f32)),
            1 => Just(trap),
            1 => Just(nested),
        ]
        .boxed(),
    };
    let rotation = prop::array::uniform3(-3.0..3.0f64);
    let letter = prop_oneof![4 => Just(None), 1 => (b'a'..=b'z').prop_map(Some)];
    (1u8..=4, letter, [number.clone(), number.clone(), number], rotation).prop_map(
        move |(station, error, position, turn)| {
            let rotation = nalgebra::UnitQuaternion::new(turn.into());
            let attitude = match Attitude::from_rotation(&rotation, format.output) {
                Attitude::EulerDeg { azimuth_deg, elevation_deg, roll_deg } => Attitude::EulerDeg {
                    azimuth_deg: sent(azimuth_deg, 100.0, format.encoding),
                    elevation_deg: sent(elevation_deg, 100.0, format.encoding),
                    roll_deg: sent(roll_deg, 100.0, format.encoding),
                },
                Attitude::Quaternion(q) => {
                    Attitude::Quaternion(q.map(|v| sent(v, 1e4, format.encoding)))
                }
            };
            FastrakRecord {
                station: Station::try_new(station).unwrap(),
                error,
                position,
                units: format.units,
                attitude,
            }
        },
    )
}

/// The value that arrives when `value` is sent.
fn sent(value: f64, parts: f64, encoding: Encoding) -> f64 {
    match encoding {
        Encoding::Ascii => (value * parts).round() / parts,
        Encoding::Binary => f64::from(value as f32),
    }
}

fn any_stream() -> impl Strategy<Value = (FastrakFormat, Vec<FastrakRecord>)> {
    any_format()
        .prop_flat_map(|format| (Just(format), prop::collection::vec(any_record(format), 1..12)))
}

fn bytes_of(records: &[FastrakRecord], format: FastrakFormat) -> Vec<u8> {
    records.iter().flat_map(|r| encode_record(r, format.encoding).unwrap()).collect()
}

fn events_in_pieces(format: FastrakFormat, bytes: &[u8], sizes: &[usize]) -> Vec<FastrakEvent> {
    let mut parser = FastrakParser::new(format);
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

fn records(events: &[FastrakEvent]) -> Vec<FastrakRecord> {
    events
        .iter()
        .filter_map(|event| match event {
            FastrakEvent::Record(record) => Some(*record),
            _ => None,
        })
        .collect()
}

fn faults(events: &[FastrakEvent]) -> Vec<FastrakFault> {
    events
        .iter()
        .filter_map(|event| match event {
            FastrakEvent::Fault(fault) => Some(*fault),
            _ => None,
        })
        .collect()
}

fn is_subsequence<T: PartialEq>(wanted: &[T], found: &[T]) -> bool {
    let mut found = found.iter();
    wanted.iter().all(|w| found.any(|f| f == w))
}

/// Bytes a random generator would hardly hit: headers, CR LF, digits.
fn noise(length: std::ops::Range<usize>) -> impl Strategy<Value = Vec<u8>> {
    let trap = prop::sample::select(b"00112 \r\n.-xS".to_vec());
    prop::collection::vec(prop_oneof![1 => any::<u8>(), 1 => trap], length)
}

proptest! {
    #[test]
    fn any_split_of_a_stream_gives_the_same_records(
        (format, sent) in any_stream(), sizes in prop::collection::vec(1usize..60, 1..20),
    ) {
        let events = events_in_pieces(format, &bytes_of(&sent, format), &sizes);
        prop_assert!(faults(&events).is_empty());
        prop_assert_eq!(records(&events), sent);
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
    fn garbage_between_records_costs_at_most_the_touched_records(
        (format, sent) in any_stream(), garbage in noise(1..100), place in any::<prop::sample::Index>(),
    ) {
        let place = place.index(sent.len());
        let mut bytes = bytes_of(&sent[..place], format);
        bytes.extend_from_slice(&garbage);
        bytes.extend(bytes_of(&sent[place..], format));
        let found = records(&events_in_pieces(format, &bytes, &[17]));
        let mut untouched = sent;
        untouched.remove(place);
        prop_assert!(is_subsequence(&untouched, &found));
    }

    #[test]
    fn starting_in_the_middle_of_a_record_costs_that_record_only(
        (format, sent) in any_stream(), cut in any::<prop::sample::Index>(),
    ) {
        let bytes = bytes_of(&sent, format);
        let cut = 1 + cut.index(format.record_length() - 1);
        // Floats whose bytes are CR LF and a header make a third record out of the ends of two; the
        // format has no checksum, so nobody could tell.
        let is_decoy = |at: usize| matches!(head(&bytes[at..], format), Head::Record(_));
        prop_assume!(!(cut..format.record_length()).any(is_decoy));
        let found = records(&events_in_pieces(format, &bytes[cut..], &[9]));
        prop_assert!(is_subsequence(&sent[1..], &found));
    }

    #[test]
    fn memory_stays_bounded_and_no_number_is_out_of_range(
        format in any_format(), bytes in noise(0..9000),
    ) {
        let mut parser = FastrakParser::new(format);
        let mut events = Vec::new();
        parser.feed_all(&bytes, |event| events.push(event));
        prop_assert!(parser.inbox.waiting().len() < 128);
        for record in records(&events) {
            prop_assert!(record.position.iter().all(|p| p.abs() < 1000.0));
            let rotation = record.world_from_receiver().rotation;
            prop_assert!((rotation.norm() - 1.0).abs() < 1e-12);
        }
    }
}

const ASCII: FastrakFormat = FastrakFormat {
    encoding: Encoding::Ascii,
    output: OutputList::PositionEuler,
    units: LengthUnit::Inches,
};
const EXAMPLE: &[u8] = b"01   10.25  -3.50  22.00  30.00  20.00  10.00\r\n";

#[test]
fn worked_example_is_read_from_text_and_from_floats() {
    let expected = FastrakRecord {
        station: Station::try_new(1).unwrap(),
        error: None,
        position: [10.25, -3.5, 22.0],
        units: LengthUnit::Inches,
        attitude: Attitude::EulerDeg { azimuth_deg: 30.0, elevation_deg: 20.0, roll_deg: 10.0 },
    };
    assert_eq!(events_in_pieces(ASCII, EXAMPLE, &[1]), [FastrakEvent::Record(expected)]);
    let binary = encode_record(&expected, Encoding::Binary).unwrap();
    let format = FastrakFormat { encoding: Encoding::Binary, ..ASCII };
    assert_eq!(events_in_pieces(format, &binary, &[1]), [FastrakEvent::Record(expected)]);
}

#[test]
fn columns_may_touch() {
    let bytes = b"03x-100.25-100.25-100.25-179.99 -89.99-179.99\r\n";
    let found = records(&events_in_pieces(ASCII, bytes, &[11]));
    assert_eq!(found[0].position, [-100.25; 3]);
    assert_eq!((found[0].station.number(), found[0].error), (3, Some(b'x')));
}

#[test]
fn status_and_error_records_between_data_are_passed_on() {
    let status = "21S3F0    2.10  some system identification text.";
    let error = "2 E*ERROR*O*ERROR* EC -99*PS1*FL2*ST1";
    for (encoding, output) in FORMATS {
        let format = FastrakFormat { encoding, output, units: LengthUnit::Inches };
        let record = records(&events_in_pieces(ASCII, EXAMPLE, &[47]))[0];
        let attitude =
            Attitude::from_rotation(&record.attitude.transmitter_from_receiver(), output);
        let data = encode_record(&FastrakRecord { attitude, ..record }, encoding).unwrap();
        let reply = |text: &str| format!("{text}\r\n").into_bytes();
        let bytes = [&data[..], &reply(status), &data, &reply(error), &data].concat();
        let events = events_in_pieces(format, &bytes, &[13]);
        assert_eq!(records(&events).len(), 3);
        assert!(faults(&events).is_empty());
        assert_eq!(events[1], FastrakEvent::Reply(status.to_owned()));
        assert_eq!(events[3], FastrakEvent::Reply(error.to_owned()));
    }
}

#[test]
fn a_run_of_garbage_is_one_fault_with_its_first_reason() {
    let bytes = [&b"garbage 0"[..], EXAMPLE].concat();
    let events = events_in_pieces(ASCII, &bytes, &[4]);
    let kind = FastrakFaultKind::UnexpectedByte { byte: b'g' };
    assert_eq!(faults(&events), [FastrakFault { kind, bytes_skipped: 9 }]);
    assert_eq!(records(&events).len(), 1);
}

#[test]
fn a_wrong_line_speed_is_reported_again_and_again() {
    let events = events_in_pieces(ASCII, &[0xf8; 5000], &[64]);
    let kind = FastrakFaultKind::UnexpectedByte { byte: 0xf8 };
    assert_eq!(faults(&events), [FastrakFault { kind, bytes_skipped: REPORT_EVERY }; 4]);
}

#[test]
fn values_no_tracker_sends_are_faults() {
    let mut bytes = EXAMPLE.to_vec();
    bytes[5] = b'e';
    let kind = FastrakFaultKind::BadNumber { index: 0 };
    let events = events_in_pieces(ASCII, &[&bytes[..], EXAMPLE].concat(), &[47]);
    assert_eq!(faults(&events), [FastrakFault { kind, bytes_skipped: 47 }]);
    let format = FastrakFormat {
        encoding: Encoding::Binary,
        output: OutputList::PositionQuaternion,
        units: LengthUnit::Inches,
    };
    let mut zero_quaternion = b"01 ".to_vec();
    zero_quaternion.extend([0; 28]);
    zero_quaternion.extend(b"\r\n\xff");
    // The zeros hold no header, so everything is one run; the fault appears with the next record.
    assert!(events_in_pieces(format, &zero_quaternion, &[1]).is_empty());
}

#[test]
fn a_hemisphere_flip_is_announced_before_its_record() {
    let opposite = b"01  -10.20   3.50 -22.05  30.00  20.00  10.00\r\n";
    let events = events_in_pieces(ASCII, &[EXAMPLE, EXAMPLE, opposite].concat(), &[5]);
    assert_eq!(events.len(), 4);
    let FastrakEvent::HemisphereFlip(flip) = &events[2] else { panic!("{:?}", events[2]) };
    assert!((flip.before.x - 10.25 * 0.0254).abs() < 1e-12);
    assert!((flip.after.z + 22.05 * 0.0254).abs() < 1e-12);
    assert!(matches!(events[3], FastrakEvent::Record(_)));
}
