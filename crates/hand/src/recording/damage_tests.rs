//! Recordings that were damaged or cut off are never taken for whole ones.

use std::path::Path;

use super::recorder::{Recorder, TickNews};
use super::tick::{RecordedSetup, TickSeen};
use super::{ReadError, Recording, VERSION_OF_ONE_HAND, read_recording};
use crate::sent::Sent;
use crate::sent::{Arrival, Device};

/// Set-up of a recording; what it says matters to nobody here.
pub(super) fn setup() -> RecordedSetup {
    RecordedSetup {
        version: VERSION_OF_ONE_HAND,
        program: "test".to_owned(),
        object: "cube".to_owned(),
        nodes: 8,
        size_m: None,
        mesh: String::new(),
        young_pa: 2e4,
        regions: Vec::new(),
        poisson: 0.4,
        element: "t4".to_owned(),
        method: "auto".to_owned(),
        contact: "mask".to_owned(),
        whole: false,
        deformation: "linear".to_owned(),
        law: String::new(),
        yield_pa: None,
        max_error: None,
        friction: None,
        placed_in_hand: false,
        hand: "test".to_owned(),
        period_s: None,
        hand_setup: String::new(),
        calibration: String::new(),
        is_live: false,
        is_even: false,
        world_from_sender: None,
        second_hand: None,
    }
}

/// Writes a recording of so many ticks.
fn record(path: &Path, ticks: u64) -> Recording {
    let mut recorder = Recorder::start(path, setup()).unwrap();
    for tick in 0..ticks {
        let bytes = vec![tick as u8; 20];
        let sent =
            Sent { arrivals: vec![Arrival::with_tick(Device::Glove, bytes)], ..Sent::default() };
        let seen = TickSeen { tick, now_s: tick as f64 / 60.0, ..TickSeen::default() };
        recorder.tick(&sent, TickNews::default(), None, seen);
    }
    recorder.finish().unwrap();
    let whole = read_recording(path).unwrap();
    assert_eq!((whole.ticks.len() as u64, &whole.cut), (ticks, &None));
    whole
}

#[test]
fn recording_with_a_flipped_bit_is_never_read_as_a_whole_one_with_other_content() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run.mcap");
    let whole = record(&path, 4);
    let bytes = std::fs::read(&path).unwrap();
    let (mut found, mut tried) = (0, 0);
    // Every fifth byte, each at another bit.
    for at in (0..bytes.len()).step_by(5) {
        let mut damaged = bytes.clone();
        damaged[at] ^= 1 << (at / 5 % 8);
        std::fs::write(&path, &damaged).unwrap();
        tried += 1;
        match read_recording(&path) {
            Err(_) => found += 1,
            Ok(read) if read.cut.is_some() => {
                found += 1;
                assert!(whole.ticks.starts_with(&read.ticks), "byte {at}: other ticks");
            }
            Ok(read) => assert_eq!(read, whole, "byte {at}"),
        }
    }
    assert!(10 * found > 9 * tried, "{found} of {tried} were found");
}

#[test]
fn recording_that_ends_anywhere_before_its_end_is_said_to_be_cut_off() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run.mcap");
    let whole = record(&path, 4);
    let bytes = std::fs::read(&path).unwrap();
    for length in (0..bytes.len()).step_by(13) {
        std::fs::write(&path, &bytes[..length]).unwrap();
        match read_recording(&path) {
            Err(ReadError::NotMcap { .. } | ReadError::NoSetup { .. }) => {}
            Err(error) => panic!("{length} bytes: {error}"),
            Ok(read) => {
                assert!(whole.ticks.starts_with(&read.ticks), "{length} bytes");
                let why = read.cut.expect("said");
                assert!(why.contains("ends in the middle"), "{length} bytes: {why}");
            }
        }
    }
}
