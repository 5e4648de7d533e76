//! A million random byte strings for each parser: it never ends abnormally, and finds the next good
//! records.

use softgrasp_hand::devices::cyberglove::{
    GloveEvent, GloveParser, GloveRecord, RawSensors, RecordKind, RecordOptions, SensorCount,
    encode_line, encode_record,
};
use softgrasp_hand::devices::fastrak::{
    self, Attitude, Encoding, FastrakEvent, FastrakFormat, FastrakParser, FastrakRecord,
    LengthUnit, OutputList, Station,
};

use super::chance::Chance;

const STRINGS: usize = 1_000_000;
/// After so many strings good records are looked for.
const BETWEEN: usize = 10;
const FORMATS: usize = 4;

/// Mostly bytes that mean something, so that the parser comes further than its first check.
fn random_string(chance: &mut Chance, meaning: &[u8]) -> Vec<u8> {
    (0..chance.below(40))
        .map(|_| match chance.below(3) {
            0 => chance.byte(),
            _ => meaning[chance.below(meaning.len())],
        })
        .collect()
}

#[test]
fn glove_parser_survives_a_million_random_strings() {
    let mut chance = Chance::new(21);
    for format in 0..FORMATS {
        let count = [SensorCount::Eighteen, SensorCount::TwentyTwo][format % 2];
        let lines = format >= 2;
        let record = GloveRecord {
            kind: RecordKind::Polled,
            sensors: RawSensors::from_fn(count, |sensor| sensor.index() as u8 * 7 + 3),
            timestamp: None,
            status: None,
        };
        let (mut parser, good) = match lines {
            false => (GloveParser::new(count, RecordOptions::default()), encode_record(&record)),
            true => (GloveParser::of_lines(count), encode_line(&record)),
        };
        for string in 1..=STRINGS / FORMATS {
            let bytes = random_string(&mut chance, b"GSgs\0\0\r\n 0123459e?gns\x03");
            parser.feed_all(&bytes, |_| {});
            if string % BETWEEN == 0 {
                // The first may be spoilt by what stands before it.
                let mut found = 0;
                for _ in 0..2 {
                    parser.feed_all(&good, |event| {
                        found += usize::from(event == GloveEvent::Record(record));
                    });
                }
                assert!(found >= 1, "after string {string}");
            }
        }
    }
}

#[test]
fn tracker_parser_survives_a_million_random_strings() {
    let mut chance = Chance::new(22);
    for number in 0..FORMATS {
        let format = FastrakFormat {
            encoding: [Encoding::Ascii, Encoding::Binary][number % 2],
            output: [OutputList::PositionEuler, OutputList::PositionQuaternion][number / 2],
            units: LengthUnit::Centimetres,
        };
        let attitude = match format.output {
            OutputList::PositionEuler => {
                Attitude::EulerDeg { azimuth_deg: 30.0, elevation_deg: 20.0, roll_deg: 10.5 }
            }
            OutputList::PositionQuaternion => Attitude::Quaternion([0.5, -0.5, 0.5, 0.5]),
        };
        let record = FastrakRecord {
            station: Station::FIRST,
            error: None,
            position: [10.25, -3.5, 22.0],
            units: format.units,
            attitude,
        };
        let good = fastrak::encode_record(&record, format.encoding).unwrap();
        let mut parser = FastrakParser::new(format);
        for string in 1..=STRINGS / FORMATS {
            let bytes = random_string(&mut chance, b"001122 \r\n\r\nS. -+19xk");
            parser.feed_all(&bytes, |_| {});
            if string % BETWEEN == 0 {
                let mut found = 0;
                for _ in 0..4 {
                    parser.feed_all(&good, |event| {
                        found += usize::from(event == FastrakEvent::Record(record));
                    });
                }
                // What stands before may have spoilt one, or three as a reply that does not end.
                assert!(found >= 1, "after string {string}: {found}");
            }
        }
    }
}
