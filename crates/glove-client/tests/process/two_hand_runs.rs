//! Runs of two hands: through the program and its server, recorded and replayed.

use std::net::UdpSocket;
use std::process::Stdio;
use std::time::{Duration, Instant};

use nalgebra::{Isometry3, Matrix3, Rotation3, Translation3, UnitQuaternion, Vector3};
use serde_json::Value;
use softgrasp_grasp::hand::{HandDimensions, Handedness, JointAngles};
use softgrasp_hand::joints::record_of_hand;

use crate::start::{Folder, command, fail, free_address, succeed};

/// Time after which a run is taken to hang.
const HANG: Duration = Duration::from_secs(120);

/// Line of a flat hand beside the origin, its palm toward it; `x` is the place of the middle of its
/// thickness, m.
fn flat_hand(side: Handedness, x: f64) -> String {
    let sign = if side == Handedness::Right { 1.0 } else { -1.0 };
    // Fingers forward, out of the palm to the middle, thumb up.
    let columns = [-sign * Vector3::y(), -Vector3::z(), sign * Vector3::x()];
    let turn = Rotation3::from_matrix_unchecked(Matrix3::from_columns(&columns));
    let place = Translation3::new(sign * x, 0.015, 0.085);
    let palm = Isometry3::from_parts(place, UnitQuaternion::from_rotation_matrix(&turn));
    let hand = HandDimensions::default().with_handedness(side);
    record_of_hand(&hand, &JointAngles::flat(), &palm).to_line()
}

/// Forces of the fingers and the palm of a hand in a step, N.
fn force_n(hand: &Value) -> f64 {
    let fingers = hand["finger_force_n"].as_array().unwrap().iter();
    fingers.map(|force| force.as_f64().unwrap()).sum::<f64>()
        + hand["palm_force_n"].as_f64().unwrap()
}

#[test]
fn both_hands_of_a_sender_press_one_object_and_are_replayed_bit_by_bit() {
    let folder = Folder::new();
    let (path, report) = (folder.path("two.mcap"), folder.path("two.json"));
    let address = free_address();
    let hand = format!("joints:{address}");
    let fixed = ["run", "--headless", "--object", "cube", "--nodes", "64", "--object-size", "0.06"];
    let mut run = command()
        .args(fixed)
        .args(["--hand", &hand, "--joints-origin", "0,0,0", "--threads", "1", "--rate", "120"])
        .args(["--record", &path, "--report", &report])
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .unwrap();
    let sender = UdpSocket::bind("127.0.0.1:0").unwrap();
    let begun = Instant::now();
    // Before the run listens nobody takes them: the hands come near only after a while, and then stay. They are
    // seen less often than the run ticks.
    for i in 0..350 {
        assert!(begun.elapsed() < HANG && run.try_wait().unwrap().is_none(), "the run ended");
        let apart = 0.05 * (1.0 - (f64::from(i - 125) / 75.0).clamp(0.0, 1.0));
        for side in [Handedness::Right, Handedness::Left] {
            let line = flat_hand(side, 0.033 + apart);
            let _ = sender.send_to(line.as_bytes(), &address);
        }
        std::thread::sleep(Duration::from_millis(20));
    }
    let kill = format!("kill -INT {}", run.id());
    assert!(std::process::Command::new("sh").args(["-c", &kill]).status().unwrap().success());
    assert_eq!(run.wait().unwrap().code(), Some(0));
    let told: Value = serde_json::from_str(&folder.read("two.json")).unwrap();
    assert_eq!(told["contact"], "friction");
    let frames = told["frames"].as_array().unwrap();
    let last = frames.iter().rev().map(|frame| &frame["contact"]).find(|step| !step.is_null());
    let last = last.expect("a step was answered");
    let (first, second) = (force_n(last), force_n(&last["second_hand"]));
    assert!(first > 0.3 && second > 0.3, "they press with {first} and {second} N");
    let recording = softgrasp_hand::recording::read_recording(path.as_ref()).unwrap();
    assert_eq!((recording.setup.version, recording.setup.is_even), (3, true));
    // Played as fast as it goes, each hand moves as it did at its own rate.
    let replay = folder.path("replay.json");
    succeed(&["replay", &path, "--check", "--threads", "2", "--report", &replay]);
    let replayed: Value = serde_json::from_str(&folder.read("replay.json")).unwrap();
    assert_eq!(replayed["replay"]["difference"], Value::Null);
    assert!(replayed["replay"]["requests"].as_u64() > Some(20), "{}", replayed["replay"]);
}

#[test]
fn two_scripts_lift_together_and_are_recorded_and_replayed() {
    let folder = Folder::new();
    let (path, report) = (folder.path("two.mcap"), folder.path("two.json"));
    let scripts = ["--hand", "scripted:lift", "--hand", "scripted:lift"];
    let fixed = ["run", "--headless", "--nodes", "200", "--threads", "2", "--ticks", "240"];
    succeed(&[&fixed[..], &scripts, &["--record", &path, "--report", &report]].concat());
    let told: Value = serde_json::from_str(&folder.read("two.json")).unwrap();
    assert_eq!(told["hand"], "scripted:lift + scripted:lift");
    let touched = told["frames"].as_array().unwrap().iter().filter(|frame| {
        let step = &frame["contact"];
        !step.is_null() && force_n(step) > 0.0 && force_n(&step["second_hand"]) > 0.0
    });
    assert!(touched.count() > 60, "both hands never pressed at once");
    succeed(&["replay", &path, "--check", "--report", &folder.path("replay.json")]);
}

#[test]
fn hands_that_do_not_go_together_are_refused_with_what_to_do() {
    let refused = |arguments: &[&str], words: &str| {
        let said = fail(1, &[&["run", "--headless"], arguments].concat());
        assert!(said.contains(words), "{arguments:?}: {said}");
    };
    let two = |a: &'static str, b: &'static str| ["--hand", a, "--hand", b];
    let scripts = two("scripted:lift", "scripted:lift");
    refused(&[&scripts[..], &["--grasp", "thesis"]].concat(), "two hands need --grasp contact");
    refused(&[&scripts[..], &["--hand", "scripted"]].concat(), "there is a right and a left hand");
    refused(&two("mouse", "mouse"), "one mouse moves one hand");
    refused(&two("mouse", "scripted:lift"), "--hand mouse needs the window");
    refused(&two("joints:127.0.0.1:7", "joints:127.0.0.1:7"), "name it once");
    refused(&two("serial:glove=/dev/a", "serial:glove=/dev/a"), "cannot share the port /dev/a");
    refused(&two("replay:a.mcap", "scripted:lift"), "replay it alone");
    let folder = Folder::new();
    let right = folder.write("right.toml", "format = 1\n");
    let setups = ["--hand-setup", &right, "--hand-setup", &right];
    refused(&[&scripts[..], &setups].concat(), "both hands are right hands");
    refused(&setups, "--hand-setup was given 2 times");
}
