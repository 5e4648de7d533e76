//! Runs with glove and tracker on serial ports, which are emulated.

#![cfg(unix)]

use std::process::{Child, Stdio};
use std::time::{Duration, Instant};

use serde_json::Value;
use softgrasp_emulator::emulation::PseudoTerminal;

use crate::emulator::Emulator;
use crate::start::{Folder, command, succeed};

/// Emulated devices of a hand that squeezes a small strawberry.
fn emulated(links: &str, more: &[&str]) -> Emulator {
    let usual = ["--script", "squeeze", "--nodes", "300", "--link-dir", links];
    Emulator::start(&[&usual[..], more].concat())
}

/// Recorded run with that hand, by the rules that the emulators' script is planned for.
fn run(folder: &Folder, links: &str, frames: &str) -> Child {
    let hand = format!("serial:glove={links}/glove,tracker={links}/tracker");
    run_with(folder, &hand, frames)
}

fn run_with(folder: &Folder, hand: &str, frames: &str) -> Child {
    let object = ["run", "--headless", "--object", "strawberry", "--nodes", "300", "--frames"];
    command()
        .args(object)
        .args([frames, "--hand", hand, "--rate", "60", "--grasp", "thesis"])
        .args(["--record", &folder.path("run.mcap"), "--report", &folder.path("run.json")])
        .stdout(Stdio::null())
        .spawn()
        .unwrap()
}

fn report(folder: &Folder, name: &str) -> Value {
    serde_json::from_str(&folder.read(name)).unwrap()
}

fn happened(report: &Value, words: &str) -> bool {
    let events = report["events"].as_array().unwrap();
    events.iter().any(|event| event["what"].as_str().unwrap().contains(words))
}

/// Checks that a replay gives the same bits, whatever came from the devices and when.
fn assert_replays(folder: &Folder) {
    let (path, again) = (folder.path("run.mcap"), folder.path("again.json"));
    succeed(&["replay", &path, "--check", "--threads", "1", "--report", &again]);
    let replay = &report(folder, "again.json")["replay"];
    assert_eq!(replay["difference"], Value::Null);
    assert_eq!(replay["cut"], Value::Null);
}

#[test]
fn glove_and_tracker_on_ports_squeeze_and_the_recording_replays() {
    let folder = Folder::new();
    let links = folder.path("ports");
    let emulator = emulated(&links, &[]);
    let mut run = run(&folder, &links, "900");
    assert_eq!(run.wait().unwrap().code(), Some(0));
    emulator.stop();
    let report = report(&folder, "run.json");
    for state in ["Attached", "Deforming"] {
        assert!(happened(&report, &format!("entered {state}")), "{}", report["events"]);
    }
    assert!(report["summary"]["solves"].as_u64().unwrap() > 0, "{}", report["summary"]);
    assert!(report["summary"]["latency"]["answers"].as_u64().unwrap() > 0);
    assert_replays(&folder);
}

/// Faults on the line, and both cables pulled and put back: the run goes on.
#[test]
fn faults_and_pulled_cables_do_not_end_a_run() {
    let folder = Folder::new();
    let links = folder.path("ports");
    let faults = ["--fault", "noise", "--fault", "truncated", "--fault", "hemisphere-flip"];
    let first = emulated(&links, &faults);
    let mut run = run(&folder, &links, "1200");
    std::thread::sleep(Duration::from_secs(6));
    first.stop();
    std::thread::sleep(Duration::from_secs(2));
    let second = emulated(&links, &[]);
    assert_eq!(run.wait().unwrap().code(), Some(0));
    second.stop();
    let report = report(&folder, "run.json");
    let summary = &report["summary"];
    for words in ["is silent: the hand is held where it was", "speaks again"] {
        assert!(happened(&report, words), "{words}: {}", report["events"]);
    }
    assert!(summary["ticks_held"].as_u64().unwrap() > 30, "{summary}");
    let faults =
        summary["glove_faults"].as_u64().unwrap() + summary["tracker_faults"].as_u64().unwrap();
    assert!(faults > 0, "{summary}");
    assert_replays(&folder);
}

/// Writes records of a glove with 18 sensors and of a tracker that do not answer commands; pulls the
/// tracker's cable for two seconds in the middle.
fn feed(links: &std::path::Path, seconds: f64) {
    let glove = PseudoTerminal::open(Some(&links.join("glove"))).unwrap();
    let plug_in = || PseudoTerminal::open(Some(&links.join("tracker"))).unwrap();
    let mut tracker = Some(plug_in());
    let begun = Instant::now();
    let (mut glove_records, mut tracker_records) = (0, 0);
    loop {
        let at_s = begun.elapsed().as_secs_f64();
        if at_s > seconds {
            return;
        }
        let is_pulled = (0.6..0.6 + 2.0 / seconds).contains(&(at_s / seconds));
        match (&tracker, is_pulled) {
            (Some(_), true) => tracker = None,
            (None, false) => tracker = Some(plug_in()),
            _ => {}
        }
        // Whatever they are asked, nobody reads it.
        let _ = glove.read();
        while f64::from(glove_records) < 100.0 * at_s {
            glove_records += 1;
            let bend = (40.0 * (0.5 * at_s).sin()) as i32;
            let sensors = (0..18).map(|i| (100 + bend + 3 * i) as u8);
            glove.write(&[vec![b'S'], sensors.collect(), vec![0]].concat());
        }
        while f64::from(tracker_records) < 120.0 * at_s {
            tracker_records += 1;
            let (x, az) = (50.0 + 2.0 * at_s.sin(), 10.0 * at_s.sin());
            let record =
                format!("01 {x:7.2}{:7.2}{:7.2}{az:7.2}{:7.2}{:7.2}\r\n", 3.0, -5.0, 0.0, 0.0);
            if let Some(tracker) = &tracker {
                let _ = tracker.read();
                tracker.write(record.as_bytes());
            }
        }
        std::thread::sleep(Duration::from_millis(4));
    }
}

#[test]
fn raw_records_of_devices_that_answer_nothing_move_the_hand_while_a_cable_is_pulled() {
    let folder = Folder::new();
    let links = folder.path("ports");
    std::fs::create_dir(&links).unwrap();
    let feeding = std::thread::spawn({
        let links = std::path::PathBuf::from(&links);
        move || feed(&links, 25.0)
    });
    let mut run = run(&folder, &links, "1500");
    feeding.join().unwrap();
    assert_eq!(run.wait().unwrap().code(), Some(0));
    let report = report(&folder, "run.json");
    let states = report["states_reached"].as_array().unwrap();
    assert!(!states.is_empty(), "there was no hand: {}", report["events"]);
    for words in ["the tracker is silent", "the tracker speaks again"] {
        assert!(happened(&report, words), "{words}: {}", report["events"]);
    }
    assert_replays(&folder);
}

#[test]
fn devices_that_are_not_there_are_named_while_the_run_waits_for_them() {
    let folder = Folder::new();
    let mut run = run(&folder, &folder.path("nowhere"), "60");
    // There never was a hand.
    assert_eq!(run.wait().unwrap().code(), Some(1));
    let report = report(&folder, "run.json");
    for words in ["the glove is not there", "the tracker is not there"] {
        assert!(happened(&report, words), "{words}: {}", report["events"]);
        assert!(report["no_hand"].to_string().contains(words), "{}", report["no_hand"]);
    }
}

#[test]
fn glove_that_never_spoke_is_not_said_to_hold_a_hand_where_it_was() {
    let folder = Folder::new();
    let links = folder.path("ports");
    let emulator = emulated(&links, &[]);
    let hand = format!("serial:glove={links}/nowhere,tracker={links}/tracker");
    // A device may take 5 s longer than the other to speak first.
    let mut run = run_with(&folder, &hand, "480");
    assert_eq!(run.wait().unwrap().code(), Some(1));
    emulator.stop();
    let report = report(&folder, "run.json");
    assert!(happened(&report, "the glove is silent: there is no hand yet"), "{}", report["events"]);
    assert!(!happened(&report, "where it was"), "{}", report["events"]);
}

#[test]
fn swapped_devices_end_a_run_with_the_sentence_that_says_so() {
    let folder = Folder::new();
    let links = folder.path("ports");
    let emulator = emulated(&links, &[]);
    let hand = format!("serial:glove={links}/tracker,tracker={links}/glove");
    let mut run = run_with(&folder, &hand, "900");
    assert_eq!(run.wait().unwrap().code(), Some(1));
    emulator.stop();
    let report = report(&folder, "run.json");
    assert!(happened(&report, "glove and tracker are swapped"), "{}", report["events"]);
    assert!(report["no_hand"].to_string().contains("swapped"), "{}", report["no_hand"]);
}
