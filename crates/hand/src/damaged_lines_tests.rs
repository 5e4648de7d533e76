//! A hand whose devices' lines flip bits, break or start late.

use nalgebra::{Isometry3, Vector3};
use softgrasp_grasp::hand::JointAngles;

use crate::hand_reader::HandReader;

use crate::hand_setup::HandSetup;
use crate::notice::NoticeKind;
use crate::sent::{Arrival, Device};

/// Numbers that look like chance and are the same every time.
struct Chance(u64);

impl Chance {
    fn next(&mut self, below: u64) -> u64 {
        self.0 =
            self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 33) % below
    }
}

/// Palm and fingers of a hand that moves as a person's, at most 1 m/s.
fn moving(t: f64) -> (Isometry3<f64>, JointAngles) {
    let at = Vector3::new(0.1 * (3.0 * t).sin(), 0.1 + 0.05 * (2.0 * t).cos(), 0.1);
    let turn = Vector3::new(0.0, 0.3 * (2.0 * t).sin(), 0.1);
    let mut angles = JointAngles::flat();
    angles.index.mcp_flexion = 0.7 + 0.6 * (2.0 * t).sin();
    (Isometry3::new(at, turn), angles)
}

/// Plays so many records of both devices, 100 a second, through `line`; returns the reader. `seen` is called
/// after each record.
fn play(
    records: u32,
    mut line: impl FnMut(u32, &mut Vec<Arrival>),
    mut seen: impl FnMut(u32, &HandReader, f64),
) -> HandReader {
    let setup = HandSetup::default();
    let mut reader = HandReader::of_devices(setup.clone(), None);
    for record in 0..records {
        let t = 0.01 * f64::from(record);
        let (palm, angles) = moving(t);
        let mut arrivals = setup.arrivals_of(&angles, &palm);
        arrivals.iter_mut().for_each(|arrival| arrival.at_s = Some(t));
        line(record, &mut arrivals);
        reader.feed(&arrivals, t);
        seen(record, &reader, t);
    }
    reader
}

#[test]
fn flipped_bits_on_both_lines_never_put_the_hand_far_away() {
    let mut chance = Chance(7);
    let mut farthest: f64 = 0.0;
    let reader = play(
        3000,
        |_, arrivals| {
            for byte in arrivals.iter_mut().flat_map(|arrival| &mut arrival.bytes) {
                // Half a percent of all bytes.
                if chance.next(200) == 0 {
                    *byte ^= 1 << chance.next(8);
                }
            }
        },
        |_, reader, t| {
            let Some(hand) = reader.hand(t) else { return };
            let (palm, _) = moving(t);
            let off = hand.world_from_palm.translation.vector - palm.translation.vector;
            farthest = farthest.max(off.norm());
        },
    );
    let faults = reader.faults();
    assert!(farthest < 0.12, "{farthest} m");
    assert!(faults.tracker_jumps > 20 && faults.glove_jumps > 20, "counted: {faults:?}");
}

#[test]
fn clean_lines_lose_nothing_to_the_gates() {
    let (mut farthest, mut hands): (f64, u32) = (0.0, 0);
    let reader = play(
        1000,
        |_, _| {},
        |_, reader, t| {
            let Some(hand) = reader.hand(t) else { return };
            hands += 1;
            let off = hand.world_from_palm.translation.vector - moving(t).0.translation.vector;
            farthest = farthest.max(off.norm());
        },
    );
    let faults = reader.faults();
    assert_eq!((faults.tracker_jumps, faults.glove_jumps), (0, 0));
    assert!(hands > 990, "{hands} of 1000 ticks had a hand");
    assert!(farthest < 1e-4, "{farthest} m");
}

/// Sensor bytes of a glove's record follow its letter.
fn set_sensor(arrivals: &mut [Arrival], wire: usize, value: u8) {
    for arrival in arrivals.iter_mut().filter(|arrival| arrival.device == Device::Glove) {
        arrival.bytes[1 + wire] = value;
    }
}

#[test]
fn sensor_that_breaks_is_told_and_the_hand_does_not_jump() {
    let mut tips: Vec<Vector3<f64>> = Vec::new();
    let mut reader = play(
        600,
        |record, arrivals| {
            // The wire of the middle finger's MPJ breaks after 3 s.
            if record >= 300 {
                set_sensor(arrivals, 7, 254);
            }
        },
        |_, reader, t| {
            let Some(hand) = reader.hand(t) else { return };
            let tip = hand.world_from_palm.inverse() * hand.fingers[2].tip();
            tips.push(tip.coords);
        },
    );
    let most = tips.windows(2).map(|pair| (pair[1] - pair[0]).norm()).fold(0.0, f64::max);
    assert!(most < 0.01, "the fingertip jumps by {most} m");
    let told = reader.take_news();
    assert!(told.iter().any(|notice| notice.text.contains("as a broken one")), "{told:?}");
}

#[test]
fn sensor_that_is_dead_from_the_start_is_told_and_the_hand_does_not_jump_when_that_is_known() {
    let mut tips: Vec<Vector3<f64>> = Vec::new();
    let mut reader = play(
        400,
        |_, arrivals| set_sensor(arrivals, 7, 254),
        |_, reader, t| {
            let Some(hand) = reader.hand(t) else { return };
            tips.push((hand.world_from_palm.inverse() * hand.fingers[2].tip()).coords);
        },
    );
    let most = tips.windows(2).map(|pair| (pair[1] - pair[0]).norm()).fold(0.0, f64::max);
    assert!(most < 0.01, "the fingertip jumps by {most} m");
    let told = reader.take_news();
    let told: Vec<_> = told.iter().filter(|notice| notice.text.contains("middle MPJ")).collect();
    let [dead] = told[..] else { panic!("one sentence is enough: {told:?}") };
    assert!(dead.text.contains("counts as dead"), "{dead:?}");
}

#[test]
fn good_news_of_a_healthy_glove_and_tracker_is_no_refusal() {
    let mut reader = play(400, |_, _| {}, |_, _, _| {});
    let told = reader.take_news();
    for words in ["a glove of 22 sensors", "a tracker, centimetres"] {
        let news = told.iter().find(|notice| notice.text.starts_with(words));
        assert_eq!(news.map(|notice| notice.kind), Some(NoticeKind::Done), "{told:?}");
    }
    assert_eq!(told.len(), 2, "{told:?}");
}

#[test]
fn healthy_start_in_which_one_device_takes_longer_says_nothing_of_silence() {
    play(
        400,
        |record, arrivals| {
            // The tracker is being set up for 2 s.
            if record < 200 {
                arrivals.retain(|arrival| arrival.device == Device::Glove);
            }
        },
        |record, reader, t| assert!(reader.silent(t).is_empty(), "record {record}"),
    );
    let late = play(700, |_, arrivals| arrivals.truncate(1), |_, _, _| {});
    assert_eq!(late.silent(6.99), [Device::Tracker], "one that never speaks is silent");
}
