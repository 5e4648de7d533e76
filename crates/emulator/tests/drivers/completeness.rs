//! Every record that a device makes arrives once and in order, in every format and mode.

use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::time::{Duration, Instant};

use softgrasp_emulator::{EmulatedGloveKind, EmulatedTrackerKind};
use softgrasp_hand::devices::cyberglove::{GloveEncoding, GloveParser, RecordOptions, SensorCount};
use softgrasp_hand::serial::{GloveMode, GloveSettings, TrackerMode, TrackerSettings};

use super::reader::{FORMATS, Reader};
use super::served::{
    Served, glove_line, glove_settings, open_glove, open_tracker, port, tracker_line,
};

/// Time without being served after which a device has answered a question too late, s.
const LATE_S: f64 = 0.08;
/// Time without being served after which a device may have been set up again, s.
const BEGUN_ANEW_S: f64 = 0.7;

/// A line holds what comes in so many seconds; what comes while nobody reads for longer is lost.
const HELD_S: f64 = 0.25;
/// What is on its way arrives within this time.
const ON_ITS_WAY: Duration = Duration::from_secs(10);

/// Every record that the device made has arrived once, in order.
fn check_complete<Line: Send + 'static>(what: &str, mut reader: Reader, served: Served<Line>) {
    let (made, stall) = (Arc::clone(&served.made), Arc::clone(&served.stall_s));
    // A device that is not served makes no more records, and what it made is on its way.
    let (ended, line) = (Instant::now(), served.end());
    let (made, stall_s) = (made.load(Ordering::Relaxed), *stall.lock().unwrap());
    if stall_s > BEGUN_ANEW_S {
        // Setting up anew throws away what has come: the last record may be among it.
        println!("{what}: the machine stalled for {stall_s:.1} s; gaps are not looked for");
        return;
    }
    // The last of a line may not have left it.
    let is_whole = reader
        .within(ON_ITS_WAY, |reader| reader.numbers.last().is_some_and(|last| last + 3 >= made));
    let to_the_end = reader.last.iter().flatten().map(|last| ended.duration_since(*last));
    let unread = to_the_end.chain([reader.longest_gap]).max().unwrap_or_default();
    if unread.as_secs_f64() > HELD_S {
        // A device of a hundred records a second is never quiet for so long: the thread that reads
        // it did not run, and the line may have been full.
        println!("{what}: nothing was read for {unread:?}; gaps are not looked for");
        return;
    }
    assert!(
        is_whole,
        "{what}: {:?} of {made}: {:?}",
        reader.numbers.last(),
        reader.devices.states()
    );
    drop((reader.devices, line));
    let numbers = reader.numbers;
    assert!(numbers.windows(2).all(|pair| pair[0] < pair[1]), "{what}: {numbers:?}");
    let all: Vec<usize> = (0..numbers.len()).collect();
    assert_eq!(numbers, all, "{what}");
    // One piece per record, and none for the replies to the set-up, if those came in time.
    assert!(stall_s > LATE_S || reader.pieces <= numbers.len() + 3, "{what}: {}", reader.pieces);
}

#[test]
fn every_glove_record_arrives_once_and_in_order() {
    let modes = [GloveMode::Polled { hz: 100.0 }, GloveMode::Streamed { hz: 100.0 }];
    let mut cases = Vec::new();
    for sensors in [SensorCount::Eighteen, SensorCount::TwentyTwo] {
        for mode in modes {
            for (encoding, timestamp, status) in [
                (GloveEncoding::Binary, false, false),
                (GloveEncoding::Binary, true, true),
                (GloveEncoding::Ascii, false, false),
            ] {
                cases.push((sensors, mode, encoding, RecordOptions { timestamp, status }));
            }
        }
    }
    std::thread::scope(|scope| {
        for (sensors, mode, encoding, options) in cases {
            scope.spawn(move || {
                let what = format!("{sensors:?} {mode:?} {encoding:?} {options:?}");
                let served = glove_line(EmulatedGloveKind { sensors, ..Default::default() }, None);
                let settings =
                    GloveSettings { encoding, options, ..glove_settings(&served.path, mode) };
                let parser = match encoding {
                    GloveEncoding::Binary => GloveParser::new(sensors, options),
                    GloveEncoding::Ascii => GloveParser::of_lines(sensors),
                };
                let mut reader = Reader::of(open_glove(settings), parser, FORMATS[0]);
                reader.until_number(&what, 250);
                let told = reader.devices.glove_facts().sensors;
                assert!(told == Some(sensors) || served.stall_s() > LATE_S, "{what}: {told:?}");
                assert_eq!(reader.devices.dropped(), 0);
                check_complete(&what, reader, served);
            });
        }
    });
}

#[test]
fn every_tracker_record_arrives_once_and_in_order() {
    std::thread::scope(|scope| {
        for format in FORMATS {
            for mode in [TrackerMode::Continuous, TrackerMode::Polled { hz: 120.0 }] {
                scope.spawn(move || {
                    let what = format!("{format:?} {mode:?}");
                    let served = tracker_line(EmulatedTrackerKind::default(), None);
                    let settings = TrackerSettings {
                        format,
                        mode,
                        ..TrackerSettings::new(port(&served.path))
                    };
                    let mut reader = Reader::of_tracker(open_tracker(settings), format);
                    reader.until_number(&what, 300);
                    let facts = reader.devices.tracker_facts();
                    let told = facts.status.is_some_and(|status| status.starts_with("21S3F"));
                    assert!(told || served.stall_s() > LATE_S, "{what}");
                    assert!(facts.complaints.is_empty(), "{:?}", facts.complaints);
                    check_complete(&what, reader, served);
                });
            }
        }
    });
}
