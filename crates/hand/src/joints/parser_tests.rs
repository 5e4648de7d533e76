//! Tests of the joints parser: any split, random bytes, long lines, datagrams.

use nalgebra::{Point3, UnitQuaternion, Vector3};
use proptest::prelude::*;
use softgrasp_grasp::hand::Handedness;

use super::*;
use crate::joints::cut::LINE_MAX;
use crate::joints::record::{JOINT_COUNT, JointSample};

fn any_sample() -> impl Strategy<Value = Option<JointSample>> {
    let triple = || prop::array::uniform3(-3.0..3.0f64);
    let orientation = prop::option::of(triple())
        .prop_map(|turn| turn.map(|turn| UnitQuaternion::new(Vector3::from(turn))));
    let sample = (triple(), orientation, prop::option::of(0.0..0.03f64)).prop_map(
        |(position, orientation, radius_m)| JointSample {
            position: Point3::from(position),
            orientation,
            radius_m,
        },
    );
    prop::option::weighted(0.8, sample)
}

fn any_record() -> impl Strategy<Value = JointsRecord> {
    let joints = prop::collection::vec(any_sample(), JOINT_COUNT);
    let time = prop::option::of(0.0..1e6f64);
    (joints, time, prop::option::of(any::<u64>()), any::<bool>()).prop_map(
        |(joints, time_s, frame, left)| {
            let hand = if left { Handedness::Left } else { Handedness::Right };
            let mut record = JointsRecord { time_s, frame, ..JointsRecord::empty(hand) };
            record.joints.copy_from_slice(&joints);
            record
        },
    )
}

/// Events of `bytes` fed in pieces of the given sizes, the last size repeated.
fn events_in_pieces(bytes: &[u8], sizes: &[usize]) -> Vec<JointsEvent> {
    let mut parser = JointsParser::new();
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

fn events_of(bytes: &[u8]) -> Vec<JointsEvent> {
    events_in_pieces(bytes, &[bytes.len().max(1)])
}

fn records(events: Vec<JointsEvent>) -> Vec<JointsRecord> {
    let record = |event| match event {
        JointsEvent::Record(record) => Some(*record),
        JointsEvent::Fault(_) => None,
    };
    events.into_iter().filter_map(record).collect()
}

fn faults(events: Vec<JointsEvent>) -> Vec<(JointsFaultKind, usize)> {
    let fault = |event| match event {
        JointsEvent::Record(_) => None,
        JointsEvent::Fault(fault) => Some((fault.kind, fault.bytes_skipped)),
    };
    events.into_iter().filter_map(fault).collect()
}

fn assert_same(sent: &JointsRecord, got: &JointsRecord) {
    assert_eq!((sent.hand, sent.frame), (got.hand, got.frame));
    assert_eq!(sent.time_s.is_some(), got.time_s.is_some());
    for (sent, got) in sent.joints.iter().zip(&got.joints) {
        assert_eq!(sent.is_some(), got.is_some());
        let (Some(sent), Some(got)) = (sent, got) else { continue };
        assert!((sent.position - got.position).norm() < 1e-14);
        assert_eq!(sent.orientation.is_some(), got.orientation.is_some());
        if let (Some(a), Some(b)) = (sent.orientation, got.orientation) {
            assert!(a.angle_to(&b) < 1e-7);
        }
        assert!((sent.radius_m.unwrap_or(-1.0) - got.radius_m.unwrap_or(-1.0)).abs() < 1e-15);
    }
}

/// Bytes a random generator would hardly hit: pieces of JSON, line ends, names of fields.
fn noise(pieces: std::ops::Range<usize>) -> impl Strategy<Value = Vec<u8>> {
    let text = prop_oneof![
        Just("\n"),
        Just("{"),
        Just("}"),
        Just("["),
        Just("]"),
        Just(","),
        Just(":"),
        Just("null"),
        Just("\"joints\""),
        Just("\"hand\""),
        Just("\"left\""),
        Just("1e400"),
        Just("-0.5"),
        Just("\"position\""),
        Just("\\u0000"),
        Just("{\"joints\":["),
        Just("\r\n"),
        Just(" "),
    ];
    let piece = prop_oneof![
        2 => text.prop_map(|t| t.as_bytes().to_vec()),
        1 => prop::collection::vec(any::<u8>(), 1..8),
    ];
    prop::collection::vec(piece, pieces).prop_map(|pieces| pieces.concat())
}

fn good_line() -> String {
    let mut record = JointsRecord::empty(Handedness::Right);
    record.joints[1] = Some(JointSample::at(Point3::new(0.5, 0.25, -0.125)));
    record.to_line()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn records_come_back_from_their_lines_in_any_split(
        sent in prop::collection::vec(any_record(), 1..5),
        sizes in prop::collection::vec(1usize..3000, 1..20),
    ) {
        let bytes: String = sent.iter().map(JointsRecord::to_line).collect();
        let got = records(events_in_pieces(bytes.as_bytes(), &sizes));
        prop_assert_eq!(got.len(), sent.len());
        for (sent, got) in sent.iter().zip(&got) {
            assert_same(sent, got);
        }
        let webxr: String = sent.iter().map(JointsRecord::to_webxr_line).collect();
        for (sent, got) in sent.iter().zip(&records(events_of(webxr.as_bytes()))) {
            let mut without_palm = *sent;
            without_palm.joints[0] = None;
            assert_same(&without_palm, got);
        }
    }

    #[test]
    fn long_lines_are_cut_alike_in_any_split(
        lengths in prop::collection::vec(0usize..3 * LINE_MAX, 1..4),
        sizes in prop::collection::vec(1usize..20_000, 1..20),
    ) {
        let mut bytes = Vec::new();
        for length in lengths {
            bytes.extend(std::iter::repeat_n(b'x', length));
            bytes.extend(b"\n");
            bytes.extend(good_line().as_bytes());
        }
        prop_assert_eq!(events_in_pieces(&bytes, &sizes), events_of(&bytes));
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(10_000))]

    #[test]
    fn any_bytes_in_any_split_give_the_same_events_and_spoil_no_later_line(
        bytes in noise(0..60), sizes in prop::collection::vec(1usize..40, 1..6),
    ) {
        let mut bytes = bytes;
        bytes.push(b'\n');
        bytes.extend(good_line().as_bytes());
        let events = events_in_pieces(&bytes, &sizes);
        prop_assert_eq!(&events, &events_of(&bytes));
        let JointsEvent::Record(last) = events.last().unwrap() else { panic!("{events:?}") };
        prop_assert_eq!(last.to_line(), good_line());
    }

    #[test]
    fn a_datagram_gives_what_a_stream_gives_that_ends_its_lines(bytes in noise(0..60)) {
        let mut parser = JointsParser::new();
        let mut events = Vec::new();
        parser.feed_datagram(&bytes, |event| events.push(event));
        let mut ended = bytes;
        if !ended.ends_with(b"\n") {
            ended.push(b'\n');
        }
        prop_assert_eq!(events, events_of(&ended));
        prop_assert!(!parser.datagram.is_inside_a_line());
    }
}

proptest! {
    #[test]
    fn every_byte_is_accounted_for_and_memory_stays_bounded(
        bytes in noise(0..3000), long in 0usize..40_000,
    ) {
        let mut all = vec![b'y'; long];
        all.extend(&bytes);
        let mut parser = JointsParser::new();
        let mut skipped = 0;
        parser.feed_all(&all, |event| match event {
            JointsEvent::Fault(fault) => skipped += fault.bytes_skipped,
            JointsEvent::Record(_) => {}
        });
        let held = parser.stream.held();
        prop_assert!(held <= LINE_MAX);
        // Empty lines are neither events nor faults.
        let counted: usize = all[..all.len() - held.min(all.len())]
            .split_inclusive(|&b| b == b'\n')
            .map(|line| if line.trim_ascii().is_empty() { 0 } else { line.len() })
            .sum();
        prop_assert_eq!(skipped, counted);
    }
}

#[test]
fn a_line_may_be_as_long_as_the_limit_and_no_longer() {
    let mut line = good_line().trim_end().to_owned();
    line.push_str(&" ".repeat(LINE_MAX - line.len()));
    line.push('\n');
    assert_eq!(records(events_in_pieces(line.as_bytes(), &[1000])).len(), 1);
    line.insert(0, ' ');
    let tail = good_line();
    let events = events_in_pieces((line.clone() + &tail).as_bytes(), &[1000]);
    assert_eq!(records(events.clone()).len(), 1, "the line behind it is read");
    let expected = [(JointsFaultKind::TooLong, LINE_MAX), (JointsFaultKind::TooLong, 2)];
    assert_eq!(faults(events), expected);
}

#[test]
fn a_stream_without_any_line_end_is_reported_again_and_again() {
    let events = events_in_pieces(&vec![b'7'; 3 * LINE_MAX + 5], &[777]);
    assert_eq!(faults(events), vec![(JointsFaultKind::TooLong, LINE_MAX); 3]);
}

#[test]
fn a_datagram_between_two_halves_of_a_line_disturbs_neither() {
    let line = good_line();
    let (head, tail) = line.split_at(40);
    let mut parser = JointsParser::new();
    let mut got = Vec::new();
    parser.feed_all(head.as_bytes(), |event| got.push(event));
    parser.feed_datagram(line.trim_end().as_bytes(), |event| got.push(event));
    parser.feed_datagram(&line.as_bytes()[..30], |event| got.push(event));
    parser.feed_all(tail.as_bytes(), |event| got.push(event));
    let kinds: Vec<bool> = got.iter().map(|e| matches!(e, JointsEvent::Record(_))).collect();
    assert_eq!(kinds, [true, false, true]);
}

#[test]
fn the_iterator_yields_what_was_fed() {
    let mut parser = JointsParser::new();
    let line = good_line();
    assert_eq!(parser.feed(&line.as_bytes()[..50]), 50);
    assert!(parser.next().is_none());
    assert_eq!(parser.feed(&line.as_bytes()[50..]), line.len() - 50);
    assert!(matches!(parser.next(), Some(JointsEvent::Record(_))));
    assert!(parser.next().is_none());
}

#[test]
fn feeding_more_than_fits_takes_a_part() {
    let mut parser = JointsParser::new();
    let taken = parser.feed(&vec![b'x'; 1 << 20]);
    assert!((LINE_MAX..=2 * LINE_MAX).contains(&taken));
    assert_eq!(parser.feed(b"x"), 0);
    assert!(parser.next().is_some());
    assert!(parser.feed(b"x") == 1);
}
