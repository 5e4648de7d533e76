//! The hand and tracker models against recordings made by others; skipped where those are absent.

use std::path::{Path, PathBuf};

use softgrasp_grasp::hand::{Finger, HandDimensions};

use super::{LeapRecording, Trajectory};
use crate::devices::fastrak::{
    Encoding, FastrakEvent, FastrakFormat, FastrakParser, FastrakRecord, LengthUnit, OutputList,
    Station, encode_record,
};

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

fn read(path: &Path) -> String {
    std::fs::read_to_string(path).unwrap()
}

/// File, poses, exact duplicates of the pose before (counted by another program).
const TRAJECTORIES: [(&str, usize, usize); 3] = [
    ("placements_removals__user3_cup5.traj", 180, 7),
    ("pick_and_place__user1_cup0.traj", 290, 1),
    ("pick_and_place__user4_b_jug2.traj", 316, 154),
];

#[test]
fn real_trajectories_have_their_known_poses_and_duplicates() {
    let Some(hand) = shared_hand() else { return };
    for (name, poses, duplicates) in TRAJECTORIES {
        let trajectory = Trajectory::parse(&read(&hand.join("fastrak").join(name))).unwrap();
        assert_eq!(trajectory.base_from_receiver.len(), poses, "{name}");
        assert_eq!(trajectory.duplicate_count(), duplicates, "{name}");
        let step = trajectory.largest_step_m();
        assert!((0.03..0.09).contains(&step), "{name}: {step} m");
    }
}

#[test]
fn a_real_trajectory_survives_the_tracker_line() {
    let Some(hand) = shared_hand() else { return };
    let station = Station::try_new(1).unwrap();
    for (name, ..) in TRAJECTORIES {
        let text = read(&hand.join("fastrak").join(name));
        let poses = Trajectory::parse(&text).unwrap().base_from_receiver;
        for output in [OutputList::PositionEuler, OutputList::PositionQuaternion] {
            let units = LengthUnit::Centimetres;
            let format = FastrakFormat { encoding: Encoding::Binary, output, units };
            let mut parser = FastrakParser::new(format);
            let mut found = Vec::new();
            for pose in &poses {
                let record = FastrakRecord::from_world(station, pose, output, units);
                let bytes = encode_record(&record, Encoding::Binary).unwrap();
                parser.feed_all(&bytes, |event| match event {
                    FastrakEvent::Record(record) => found.push(record.world_from_receiver()),
                    other => panic!("{other:?}"),
                });
            }
            assert_eq!(found.len(), poses.len());
            for (sent, got) in poses.iter().zip(&found) {
                let off = (sent.translation.vector - got.translation.vector).norm();
                assert!(off < 1e-6 && sent.rotation.angle_to(&got.rotation) < 1e-5);
            }
        }
    }
}

/// Segment lengths that a recorded hand has, against the model scaled to the same middle finger.
fn compare(name: &str, recorded: &[[f64; 3]; 5], tolerance: f64) {
    let middle: f64 = recorded[Finger::Middle.index()].iter().sum();
    let model = HandDimensions::default().segment_lengths();
    let scale = middle / model[Finger::Middle.index()].iter().sum::<f64>();
    assert!((0.8..1.2).contains(&scale), "{name}: a hand {scale} times the default one");
    for finger in &Finger::ALL[1..] {
        let (recorded, model) = (&recorded[finger.index()], &model[finger.index()]);
        let totals = [recorded, model].map(|lengths| lengths.iter().sum::<f64>());
        assert!((totals[0] / (totals[1] * scale) - 1.0).abs() < tolerance, "{name} {finger:?}");
        for i in 0..3 {
            let off = (recorded[i] / (model[i] * scale) - 1.0).abs();
            assert!(off < 2.0 * tolerance, "{name} {finger:?} segment {i}: {off}");
        }
    }
}

#[test]
fn camera_tracked_hands_have_the_lengths_of_the_model() {
    let Some(hand) = shared_hand() else { return };
    for (name, count) in [("grab", 374), ("pinch", 307), ("HandSplay-110fps", 288)] {
        let text = read(&hand.join("leap").join(format!("{name}.csv")));
        let recording = LeapRecording::parse(&text).unwrap();
        assert_eq!(recording.frames.len(), count, "{name}");
        let first = recording.frames[0];
        let lengths = Finger::ALL.map(|finger| first.segment_lengths(finger));
        for frame in &recording.frames {
            for finger in Finger::ALL {
                let now = frame.segment_lengths(finger);
                for i in 0..3 {
                    let change = (now[i] - lengths[finger.index()][i]).abs();
                    assert!(change < 2e-4, "{name}: bones are rigid");
                }
            }
        }
        let pace = recording.frames[count - 1].time_s / (count - 1) as f64;
        assert!((1.0 / 130.0..1.0 / 90.0).contains(&pace), "{name}: {pace} s a frame");
        compare(name, &lengths, 0.12);
    }
}

#[test]
fn headset_hands_have_the_lengths_and_radii_of_the_model() {
    let Some(hand) = shared_hand() else { return };
    let text = read(&hand.join("webxr/iwer_hand_poses.json"));
    let json: serde_json::Value = serde_json::from_str(&text).unwrap();
    for pose in ["relaxed", "pinch", "point"] {
        let joint = |name: &str| &json["poses"][pose]["joints"][name];
        let place = |name: &str| {
            let matrix = &joint(name)["matrix"];
            nalgebra::Point3::from([12, 13, 14].map(|i| matrix[i].as_f64().unwrap()))
        };
        let mut lengths = [[0.0; 3]; 5];
        for (finger, word) in Finger::ALL[1..].iter().zip(["index", "middle", "ring", "pinky"]) {
            let names = ["phalanx-proximal", "phalanx-intermediate", "phalanx-distal", "tip"]
                .map(|bone| format!("{word}-finger-{bone}"));
            for i in 0..3 {
                lengths[finger.index()][i] = (place(&names[i + 1]) - place(&names[i])).norm();
                let radius = joint(&names[i])["radius"].as_f64().unwrap();
                let model = HandDimensions::default().segment_radii()[finger.index()][i];
                assert!((radius - model).abs() < 1e-4, "{pose} {}", names[i]);
            }
        }
        compare(pose, &lengths, 0.15);
    }
}
