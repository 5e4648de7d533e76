//! Runs that are recorded and played again.

use crate::start::{Folder, fail, run, succeed};

/// Records a run of a small strawberry.
fn record(folder: &Folder, more: &[&str]) -> String {
    let path = folder.path("run.mcap");
    let nodes = ["run", "--headless", "--object", "strawberry", "--nodes", "300", "--threads", "2"];
    let output = run(&[&nodes[..], &["--record", &path], more].concat());
    assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
    path
}

/// Report of a replay.
fn replay(folder: &Folder, path: &str, more: &[&str]) -> serde_json::Value {
    let report = folder.path("replay.json");
    succeed(&[&["replay", path, "--check", "--report", &report], more].concat());
    serde_json::from_str(&folder.read("replay.json")).unwrap()
}

#[test]
fn recording_in_lockstep_is_replayed_bit_by_bit_whatever_the_threads() {
    let folder = Folder::new();
    let path = record(&folder, &["--hand", "scripted:regrasp"]);
    for threads in ["1", "3"] {
        let report = replay(&folder, &path, &["--threads", threads]);
        assert!(report["replay"]["requests"].as_u64().unwrap() > 100, "{}", report["replay"]);
        assert_eq!(report["replay"]["difference"], serde_json::Value::Null);
        assert_eq!(report["summary"]["shapes_kept"], 1);
    }
}

/// In real time answers come when they come; the replay takes each in the tick that took it.
#[test]
fn recording_in_real_time_is_replayed_bit_by_bit_whatever_the_speed() {
    let folder = Folder::new();
    let path = record(&folder, &["--hand", "scripted:regrasp", "--rate", "120"]);
    for speed in ["0", "4"] {
        let report = replay(&folder, &path, &["--speed", speed, "--threads", "1"]);
        assert_eq!(report["replay"]["cut"], serde_json::Value::Null);
        assert!(report["replay"]["ticks"].as_u64().unwrap() > 100, "{}", report["replay"]);
    }
}

#[test]
fn recording_of_a_replay_is_the_recording() {
    let folder = Folder::new();
    let path = record(&folder, &["--hand", "scripted:squeeze"]);
    let again = folder.path("again.mcap");
    let hand = format!("replay:{path}");
    succeed(&["run", "--headless", "--hand", &hand, "--record", &again]);
    let third = folder.path("third.mcap");
    succeed(&["record", &third, "--headless", "--hand", &hand]);
    let [first, second, third] = [&path, &again, &third]
        .map(|path| softgrasp_hand::recording::read_recording(path.as_ref()).unwrap());
    assert!(!first.ticks.is_empty());
    assert!(first.ticks == second.ticks && first.ticks == third.ticks);
}

#[test]
fn recording_that_was_cut_off_is_replayed_up_to_the_cut_and_its_check_fails() {
    let folder = Folder::new();
    let path = record(&folder, &["--hand", "scripted:squeeze"]);
    let whole = std::fs::read(&path).unwrap();
    let all = replay(&folder, &path, &[])["replay"]["ticks"].as_u64().unwrap();
    let (cut, report) = (folder.path("cut.mcap"), folder.path("cut.json"));
    std::fs::write(&cut, &whole[..whole.len() * 6 / 10]).unwrap();
    succeed(&["replay", &cut, "--report", &report]);
    let report: serde_json::Value = serde_json::from_str(&folder.read("cut.json")).unwrap();
    let ticks = report["replay"]["ticks"].as_u64().unwrap();
    assert!(report["replay"]["cut"].is_string() && ticks < all, "{}", report["replay"]);
    check_fails(&cut, &format!("only its first {ticks} ticks could be compared"));
}

/// Checks that `replay --check` of this recording ends with exit code 1 and prints these words.
fn check_fails(path: &str, words: &str) {
    let output = run(&["replay", path, "--check"]);
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(1), "{said}");
    assert!(said.contains(words), "{said}");
}

#[test]
fn check_fails_for_a_recording_with_a_flipped_bit_and_for_one_without_ticks() {
    let folder = Folder::new();
    let path = record(&folder, &["--hand", "scripted:approach"]);
    let mut bytes = std::fs::read(&path).unwrap();
    let at = bytes.len() * 6 / 10;
    bytes[at] ^= 4;
    let damaged = folder.path("damaged.mcap");
    std::fs::write(&damaged, bytes).unwrap();
    check_fails(&damaged, "the recording is not whole");
    let empty = folder.path("empty.mcap");
    rewrite_where(&path, &empty, |topic| topic == "/setup", |_, text| text.to_owned());
    check_fails(&empty, "nothing was compared");
}

/// A recording that somebody sends must not open files elsewhere, nor show what is in them.
#[test]
fn recording_that_names_a_file_outside_its_folder_is_refused_and_nothing_of_it_is_shown() {
    let folder = Folder::new();
    let path = record(&folder, &["--hand", "scripted:approach"]);
    let secret = folder.write("secret.msh", "root:x:0:0: the words of a secret");
    let inner = Folder::new();
    let changed = inner.path("changed.mcap");
    for named in [secret.as_str(), "/etc/passwd", "../../../../../../etc/passwd"] {
        rewrite(&path, &changed, |at, text| match at {
            "/setup" => text.replacen("\"strawberry\"", &format!("{named:?}"), 1),
            _ => text.to_owned(),
        });
        let hand = format!("replay:{changed}");
        for words in [&["replay", &changed, "--check"][..], &["run", "--headless", "--hand", &hand]]
        {
            let said = fail(1, words);
            assert!(said.contains("is no file below the recording's folder"), "{said}");
            assert!(!said.contains("root"), "{said}");
        }
        // Whoever plays it may name the file; then it is read as any mesh that was named.
        let said = fail(1, &["replay", &changed, "--object", &secret]);
        assert!(said.contains("secret.msh") && !said.contains("below"), "{said}");
    }
}

#[test]
fn mesh_file_beside_its_recording_is_found_from_any_folder() {
    let folder = Folder::new();
    let (mesh, path) = (folder.path("box.msh"), folder.path("run.mcap"));
    succeed(&["mesh", "cube", "--nodes", "64", "--out", &mesh]);
    succeed(&[
        "run",
        "--headless",
        "--object",
        &mesh,
        "--hand",
        "scripted:approach",
        "--record",
        &path,
    ]);
    let moved = Folder::new();
    for file in ["box.msh", "run.mcap"] {
        std::fs::copy(folder.path(file), moved.path(file)).unwrap();
    }
    drop(folder);
    succeed(&["replay", &moved.path("run.mcap"), "--check"]);
}

/// Writes a recording again with changed messages.
fn rewrite(path: &str, to: &str, change: impl Fn(&str, &str) -> String) {
    rewrite_where(path, to, |_| true, change);
}

/// Writes a recording again with the messages of some topics, changed.
fn rewrite_where(
    path: &str,
    to: &str,
    wanted: impl Fn(&str) -> bool,
    change: impl Fn(&str, &str) -> String,
) {
    let bytes = std::fs::read(path).unwrap();
    let mut file = mcap::WriteOptions::new()
        .compression(None)
        .create(std::io::BufWriter::new(std::fs::File::create(to).unwrap()))
        .unwrap();
    for message in mcap::MessageStream::new(&bytes).unwrap() {
        let mut message = message.unwrap();
        if !wanted(&message.channel.topic) {
            continue;
        }
        let text = std::str::from_utf8(&message.data).unwrap();
        message.data = change(&message.channel.topic, text).into_bytes().into();
        file.write(&message).unwrap();
    }
    file.finish().unwrap();
}

#[test]
fn replay_names_the_tick_and_the_stage_that_differ_first() {
    let folder = Folder::new();
    let path = record(&folder, &["--hand", "scripted:squeeze"]);
    let changed = folder.path("changed.mcap");
    // In the bytes of the glove that a tick took, and in what stages made.
    for (topic, find, put, words) in [
        ("/tick", "\"displacement\":\"", "\"displacement\":\"x", "tick 0: the displacement"),
        ("/tick", "\"request\":\"", "\"request\":\"x", "tick 0: the request"),
        ("/tick", "\"contacts\":\"", "\"contacts\":\"x", "tick 0: the contacts"),
        ("/glove", "\"hex\":\"47", "\"hex\":\"4701", "the pose"),
    ] {
        rewrite(&path, &changed, |at, text| match at == topic {
            true => text.replacen(find, put, 1),
            false => text.to_owned(),
        });
        let output = run(&["replay", &changed, "--check"]);
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(1), "{said}");
        assert!(said.contains("differs from its recording in tick"), "{said}");
        assert!(said.contains(words), "{topic}: {said}");
    }
}

#[test]
fn what_is_no_recording_is_told_in_a_sentence() {
    let folder = Folder::new();
    let text = folder.write("text.mcap", "this is no recording");
    let gone = folder.path("gone.mcap");
    for (path, words) in [(&text, "is no recording"), (&gone, "cannot read the recording")] {
        let said = fail(1, &["replay", path]);
        assert!(said.contains(words) && said.lines().count() == 1, "{said}");
    }
    let path = record(&folder, &["--hand", "scripted:approach"]);
    let hand = format!("replay:{path}");
    let said = fail(1, &["run", "--headless", "--hand", &hand, "--object", "cube"]);
    assert!(said.contains("was made with another strawberry"), "{said}");
    let folder_as_file = fail(1, &["run", "--headless", "--record", "/"]);
    assert!(folder_as_file.contains("cannot record to /"), "{folder_as_file}");
}

/// Files that other programs recorded move the hand as well, and such a run is recorded like any.
#[test]
fn recordings_of_other_programs_move_the_hand() {
    let Some(hands) = crate::start::shared("hand") else { return };
    let folder = Folder::new();
    for file in ["fastrak/pick_and_place__user1_cup0.traj", "leap/grab.csv", "leap/pinch.csv"] {
        let hand = format!("replay:{}", hands.join(file).display());
        let path = record(&folder, &["--hand", &hand]);
        let report = replay(&folder, &path, &["--threads", "1"]);
        assert!(report["replay"]["ticks"].as_u64().unwrap() > 90, "{file}: {}", report["replay"]);
        let states = report["states_reached"].as_array().unwrap();
        assert!(states.iter().any(|state| state == "Free"), "{file}: {states:?}");
        assert_eq!(report["summary"]["joint_faults"], 0, "{file}");
        let fit = &report["summary"]["joint_fit"];
        assert_eq!(fit.is_null(), file.ends_with(".traj"), "{file}: {fit}");
        assert!(fit["rms_m"].as_f64().is_none_or(|rms_m| rms_m < 0.01), "{file}: {fit}");
    }
}
