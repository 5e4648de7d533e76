//! Hands that others recorded, fitted; skipped where the recordings are absent.

use std::path::{Path, PathBuf};

use nalgebra::Vector3;
use softgrasp_grasp::hand::{Finger, HandDimensions};

use super::{
    HandFit, HandSize, JOINT_NAMES, JointsEvent, JointsParser, JointsRecord, WRIST, digit_joints,
    fitted_dimensions, hand_size, record_of_hand,
};
use crate::devices::recordings::LeapRecording;

/// The folder of shared recordings: `SOFTGRASP_SHARED`, or `shared` beside a folder above.
fn shared_hand() -> Option<PathBuf> {
    let named = std::env::var_os("SOFTGRASP_SHARED").map(PathBuf::from);
    let above = Path::new(env!("CARGO_MANIFEST_DIR")).ancestors().map(|a| a.join("shared"));
    let found = named.into_iter().chain(above).map(|s| s.join("hand")).find(|h| h.is_dir());
    if found.is_none() {
        println!("skipped: no shared hand recordings");
    }
    found
}

/// Poses of the emulator's hand (a left one), read from lines as a browser would send them.
fn webxr_records(folder: &Path) -> Vec<JointsRecord> {
    let text = std::fs::read_to_string(folder.join("webxr/iwer_hand_poses.json")).unwrap();
    let json: serde_json::Value = serde_json::from_str(&text).unwrap();
    let mut parser = JointsParser::new();
    let mut records = Vec::new();
    for pose in ["relaxed", "pinch", "point"] {
        let joints = &json["poses"][pose]["joints"];
        let matrices: Vec<String> =
            JOINT_NAMES[WRIST..].iter().map(|name| joints[name]["matrix"].to_string()).collect();
        let line = format!("{{\"hand\":\"left\",\"joints\":[{}]}}", matrices.join(","));
        parser.feed_datagram(line.as_bytes(), |event| match event {
            JointsEvent::Record(record) => records.push(*record),
            JointsEvent::Fault(fault) => panic!("{pose}: {fault}"),
        });
    }
    assert_eq!(records.len(), 3);
    records
}

const LEAP_FILES: [&str; 3] = ["grab", "pinch", "HandSplay-110fps"];

fn leap_records(folder: &Path, name: &str) -> Vec<JointsRecord> {
    let text = std::fs::read_to_string(folder.join("leap").join(format!("{name}.csv"))).unwrap();
    let recording = LeapRecording::parse(&text).unwrap();
    recording.frames.iter().map(JointsRecord::from).collect()
}

/// Errors that fits of all records leave, in m.
#[derive(Clone, Copy, Debug, Default)]
struct Errors {
    /// Mean over the records of the root mean square over the joints.
    mean_rms: f64,
    /// The largest such root mean square.
    worst_rms: f64,
    /// Largest distance of a fingertip.
    tip: f64,
}

fn errors(hand: &HandDimensions, records: &[JointsRecord]) -> Errors {
    let mut fit = HandFit::new(*hand);
    let mut errors = Errors::default();
    for record in records {
        let fitted = fit.fit(record).unwrap();
        let model = record_of_hand(hand, &fitted.angles, &fitted.world_from_palm);
        for tip in Finger::ALL.map(|finger| digit_joints(finger)[3]) {
            let off = model.position(tip).unwrap() - record.position(tip).unwrap();
            errors.tip = errors.tip.max(off.norm());
        }
        errors.mean_rms += fitted.fit_error_rms_m / records.len() as f64;
        errors.worst_rms = errors.worst_rms.max(fitted.fit_error_rms_m);
    }
    errors
}

/// Fits records with the usual hand, one of the measured size, and one of the measured bones.
fn check(name: &str, records: &[JointsRecord]) {
    let HandSize { length_m, breadth_m } = hand_size(records).unwrap();
    let side = records[0].hand;
    let usual = HandDimensions::default().with_handedness(side);
    let sized = HandDimensions::scaled(length_m, breadth_m).unwrap().with_handedness(side);
    let own = fitted_dimensions(records).unwrap();
    println!("{name}: {:.0} by {:.0} mm", 1e3 * length_m, 1e3 * breadth_m);
    // Half as much again as was measured: mean rms, worst rms, worst fingertip, in mm.
    for (what, hand, bounds) in [
        ("usual hand", usual, [8.0, 9.0, 13.0]),
        ("its size", sized, [6.0, 8.0, 13.0]),
        ("its bones", own, [2.4, 3.9, 6.0]),
    ] {
        let Errors { mean_rms, worst_rms, tip } = errors(&hand, records);
        let found = [mean_rms, worst_rms, tip].map(|error| 1e3 * error);
        let [mean, worst, tip] = found;
        println!("  {what}: rms {mean:.2} mm, at most {worst:.2}; fingertips at most {tip:.2}");
        let is_good = found.iter().zip(&bounds).all(|(found, bound)| found < bound);
        assert!(is_good, "{name}, {what}: {found:?} mm");
    }
}

/// Palm normal (out of the palm) and direction (to the fingers) that a Leap file itself gives.
fn leap_palms(folder: &Path, name: &str) -> Vec<[Vector3<f64>; 2]> {
    let path = folder.join("leap").join(format!("{name}.csv"));
    let mut reader = csv::Reader::from_path(path).unwrap();
    let header = reader.headers().unwrap().clone();
    let column = |name: &str| header.iter().position(|h| h == name).unwrap();
    let columns = ["palm_normal", "direction"]
        .map(|word| ["x", "y", "z"].map(|axis| column(&format!("{word}_{axis}"))));
    let number = |row: &csv::StringRecord, at: usize| row[at].parse::<f64>().unwrap();
    reader
        .records()
        .map(|row| {
            let row = row.unwrap();
            columns.map(|axes| Vector3::from(axes.map(|at| number(&row, at))).normalize())
        })
        .collect()
}

#[test]
fn poses_of_a_headset_are_fitted() {
    let Some(folder) = shared_hand() else { return };
    check("headset", &webxr_records(&folder));
}

#[test]
fn camera_tracked_hands_are_fitted() {
    let Some(folder) = shared_hand() else { return };
    for name in LEAP_FILES {
        check(name, &leap_records(&folder, name));
    }
}

#[test]
fn the_palm_lies_as_the_camera_itself_has_it() {
    let Some(folder) = shared_hand() else { return };
    for name in LEAP_FILES {
        let records = leap_records(&folder, name);
        let mut fit = HandFit::new(fitted_dimensions(&records).unwrap());
        let mut worst = [0.0_f64; 2];
        for (record, [normal, direction]) in records.iter().zip(leap_palms(&folder, name)) {
            let palm = fit.fit(record).unwrap().world_from_palm;
            let off = [palm * -Vector3::z(), palm * Vector3::y()];
            worst[0] = worst[0].max(off[0].angle(&normal));
            worst[1] = worst[1].max(off[1].angle(&direction));
        }
        let [normal, direction] = worst.map(f64::to_degrees);
        println!("{name}: palm normal at most {normal:.1} degrees off, direction {direction:.1}");
        // The camera's palm is its own: no frame of bones, but fixed in the hand.
        assert!(normal < 16.0 && direction < 16.0, "{name}");
    }
}

#[test]
fn a_recorded_grab_bends_the_fingers() {
    let Some(folder) = shared_hand() else { return };
    let records = leap_records(&folder, "grab");
    let mut fit = HandFit::new(fitted_dimensions(&records).unwrap());
    let bends: Vec<f64> =
        records.iter().map(|r| fit.fit(r).unwrap().angles.middle.pip_flexion).collect();
    let least = bends.iter().copied().fold(f64::MAX, f64::min);
    let most = bends.iter().copied().fold(f64::MIN, f64::max);
    println!("grab: the middle finger bends from {least:.2} to {most:.2} rad");
    assert!(least < 0.5 && most > 1.0, "from {least} to {most}");
}
