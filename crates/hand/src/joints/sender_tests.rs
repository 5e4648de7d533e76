//! The example sender against the listener; skipped where there is no Python.

use std::net::SocketAddr;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use softgrasp_grasp::hand::{HandDimensions, Handedness};

use super::{HandFit, JointsEvent, JointsListener, JointsParser, JointsRecord};

/// Long enough for a machine that has other things to do.
const PATIENCE: Duration = Duration::from_secs(60);

fn script() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/examples/send_joints.py")
}

fn has_python() -> bool {
    let asked = Command::new("python3").arg("--version").stdout(Stdio::null()).status();
    let has_it = asked.is_ok_and(|status| status.success());
    if !has_it {
        println!("skipped: no python3");
    }
    has_it
}

/// The sender, ended with its test however that ends.
struct Sender(Child);

impl Sender {
    fn start(listener: &JointsListener, arguments: &[&str]) -> Self {
        let port = listener.local_addr().port().to_string();
        let mut command = Command::new("python3");
        command.arg(script()).args(["--port", &port]).args(arguments);
        Self(command.spawn().unwrap())
    }
}

impl Drop for Sender {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// Records that the sender sends, at least `count`.
fn heard(arguments: &[&str], count: usize) -> Vec<JointsRecord> {
    let mut listener = JointsListener::bind(SocketAddr::from(([127, 0, 0, 1], 0))).unwrap();
    let sender = Sender::start(&listener, arguments);
    let mut parser = JointsParser::new();
    let mut records = Vec::new();
    let started = Instant::now();
    while records.len() < count {
        assert!(started.elapsed() < PATIENCE, "{} records", records.len());
        for piece in listener.take() {
            parser.feed_all(&piece.bytes, |event| match event {
                JointsEvent::Record(record) => records.push(*record),
                JointsEvent::Fault(fault) => panic!("{fault}"),
            });
        }
        std::thread::sleep(Duration::from_millis(2));
    }
    drop(sender);
    records
}

#[test]
fn the_example_sends_a_hand_that_closes_and_opens() {
    if !has_python() {
        return;
    }
    for (arguments, side) in [
        (&["--rate", "30"][..], Handedness::Right),
        (&["--rate", "30", "--tcp", "--left", "--webxr"], Handedness::Left),
    ] {
        // A hand closes within two seconds.
        let records = heard(arguments, 60);
        let mut fit = HandFit::new(HandDimensions::default().with_handedness(side));
        let mut bends = Vec::new();
        for record in &records {
            let fitted = fit.fit(record).unwrap();
            assert!(fitted.fit_error_rms_m < 6e-3, "{arguments:?}: {fitted:?}");
            bends.push(fitted.angles.middle.pip_flexion);
        }
        let (least, most) =
            bends.iter().fold((f64::MAX, f64::MIN), |(l, m), b| (l.min(*b), m.max(*b)));
        assert!(least < 0.4 && most > 1.2, "{arguments:?}: from {least} to {most}");
        let numbers: Vec<u64> = records.iter().map(|r| r.frame.unwrap()).collect();
        assert!(numbers.windows(2).all(|pair| pair[0] < pair[1]));
    }
}

#[test]
fn the_example_sends_recorded_matrices() {
    if !has_python() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("poses.json");
    let hand = HandDimensions::default().with_handedness(Handedness::Left);
    let record = super::record_of_hand(
        &hand,
        &softgrasp_grasp::hand::JointAngles::fist(),
        &nalgebra::Isometry3::identity(),
    );
    let joints: Vec<String> = (super::WRIST..super::JOINT_COUNT)
        .map(|joint| {
            let p = record.position(joint).unwrap();
            let matrix = format!("[1,0,0,0,0,1,0,0,0,0,1,0,{},{},{},1]", p.x, p.y, p.z);
            format!("\"{}\":{{\"matrix\":{matrix}}}", super::JOINT_NAMES[joint])
        })
        .collect();
    let text = format!("{{\"poses\":{{\"fist\":{{\"joints\":{{{}}}}}}}}}", joints.join(","));
    std::fs::write(&path, text).unwrap();
    let path = path.to_str().unwrap();
    let records = heard(&["--file", path, "--at", "0", "0", "0", "--rate", "20"], 2);
    let fitted = HandFit::new(hand).fit(&records[1]).unwrap();
    assert!(fitted.fit_error_max_m < 1e-6, "{fitted:?}");
}
