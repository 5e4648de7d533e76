//! Emulated devices as a process, and the list of serial ports.

#![cfg(unix)]

use std::time::{Duration, Instant};

use softgrasp_hand::devices::cyberglove::{
    GloveEvent, GloveParser, RecordOptions, Sensor, SensorCount,
};
use softgrasp_hand::sent::Device;
use softgrasp_hand::serial::{SerialDevices, SerialSettings};

use crate::emulator::Emulator;
use crate::start::{Folder, fail, succeed};

/// Time after which a process is taken to hang.
const HANG: Duration = Duration::from_secs(120);

#[test]
fn emulated_squeeze_bends_the_fingers_of_whoever_listens() {
    let folder = Folder::new();
    let links = folder.path("ports");
    let emulator = Emulator::start(&[
        "--script",
        "squeeze",
        "--object",
        "cube",
        "--nodes",
        "64",
        "--link-dir",
        &links,
        "--sensors",
        "18",
    ]);
    let glove = emulator.source.glove.as_ref().unwrap();
    assert_eq!(glove.path, std::path::Path::new(&links).join("glove"));
    let mut devices = SerialDevices::open(SerialSettings::from(&emulator.source)).unwrap();
    let mut parser = GloveParser::new(SensorCount::Eighteen, RecordOptions::default());
    let (mut bends, mut tracked) = (Vec::new(), 0);
    let begun = Instant::now();
    // The script takes some four seconds; the first and the last record are at rest.
    while bends.len() < 500 || tracked < 500 {
        assert!(begun.elapsed() < HANG, "{:?}", devices.states());
        for arrived in devices.take() {
            match arrived.device {
                Device::Tracker => tracked += 1,
                Device::Joints => panic!("nobody sends joints over a serial line"),
                Device::Glove => parser.feed_all(&arrived.bytes, |event| match event {
                    GloveEvent::Record(record) => {
                        bends.push(record.sensors.get(Sensor::IndexMcp).unwrap());
                    }
                    GloveEvent::Fault(fault) => panic!("{fault}"),
                }),
            }
        }
        std::thread::sleep(Duration::from_millis(5));
    }
    let (first, last) = (bends[0], *bends.last().unwrap());
    assert!(last > first + 10, "index finger from {first} to {last} counts");
    drop(devices);
    emulator.stop();
    assert!(std::fs::symlink_metadata(format!("{links}/glove")).is_err(), "the link stays");
}

#[test]
fn replayed_devices_are_recognised() {
    let folder = Folder::new();
    let pose = "1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n\n";
    let recording = folder.write("still.traj", &pose.repeat(3));
    let emulator = Emulator::start(&["--replay", &recording, "--baud", "38400", "--left"]);
    let glove = emulator.source.glove.as_ref().unwrap().path.display().to_string();
    let tracker = emulator.source.tracker.as_ref().unwrap().path.display().to_string();
    let told = succeed(&["devices", "--probe", &glove, &tracker, "/dev/there-is-none"]);
    let lines: Vec<&str> = told.lines().collect();
    assert!(lines[0].contains("glove at 38400 baud, 22 sensors"), "{told}");
    assert!(lines[1].contains("tracker at 38400 baud"), "{told}");
    assert!(lines[2].contains("there is no /dev/there-is-none"), "{told}");
    emulator.stop();
}

#[test]
fn ports_are_listed_or_their_absence_is_told() {
    let told = succeed(&["devices"]);
    assert!(told.contains("no serial port found") || told.contains("/dev/"), "{told}");
}

#[test]
fn emulators_end_by_themselves_when_asked_to_and_refuse_nonsense() {
    let folder = Folder::new();
    let pose = "1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n\n";
    let recording = folder.write("still.traj", pose);
    let told = succeed(&["emulate", "--replay", &recording, "--seconds", "0.2"]);
    assert!(told.starts_with("glove /dev/") && told.contains("\ntracker /dev/"), "{told}");
    assert!(fail(2, &["emulate", "--fault", "rain"]).contains("no fault is called 'rain'"));
    assert!(fail(2, &["emulate", "--fault", "burst:3"]).contains("from 0 to 1"));
    assert!(fail(1, &["emulate", "--replay", "x.bvh"]).contains("there are .traj and .mcap"));
    let wrong = folder.write("wrong.traj", "1 2 3\n");
    assert!(fail(1, &["emulate", "--replay", &wrong]).contains("line 1"));
}
