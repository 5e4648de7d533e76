//! Runs in which the hand grasps by contact with friction.

use serde_json::Value;

use crate::start::{Folder, fail, succeed};

/// Report of a run with a strawberry of 300 nodes.
fn lifted(folder: &Folder, more: &[&str]) -> Value {
    let report = folder.path("lift.json");
    let nodes: &[&str] = if more.contains(&"--nodes") { &[] } else { &["--nodes", "300"] };
    let run = ["run", "--headless", "--threads", "2", "--report", &report];
    succeed(&[&run[..], nodes, more].concat());
    serde_json::from_str(&folder.read("lift.json")).unwrap()
}

#[test]
fn run_of_which_nothing_is_said_lifts_a_strawberry_and_says_how_wrong_every_step_is() {
    let folder = Folder::new();
    let report = lifted(&folder, &[]);
    assert_eq!(report["hand"], "scripted:lift");
    assert_eq!(report["contact"], "friction");
    let frames = report["frames"].as_array().unwrap();
    let steps: Vec<&Value> =
        frames.iter().map(|frame| &frame["contact"]).filter(|step| !step.is_null()).collect();
    assert!(steps.len() > 100, "{} steps", steps.len());
    // Once it is lifted the fingers carry its weight and the table nothing.
    assert!(ticks_carried(&report) > 60, "the hand never carried it");
    for step in steps {
        for number in ["penetration_max_m", "residual_n", "residual_rel", "cone_violation_n"] {
            assert!(step[number].as_f64().unwrap() >= 0.0, "{number} in {step}");
        }
    }
    let all = &report["summary"]["contact"];
    assert!(all["penetration_max_m"].as_f64().unwrap() < 5e-4, "{all}");
    assert!(all["steps"].as_u64() > all["not_converged"].as_u64(), "{all}");
}

/// Ticks of a run in which the fingers carry the object and the table nothing.
fn ticks_carried(report: &Value) -> usize {
    let frames = report["frames"].as_array().unwrap().iter();
    let of_step = frames.map(|frame| &frame["contact"]).filter(|step| !step.is_null());
    let carries = |step: &&Value| {
        let fingers = step["finger_force_n"].as_array().unwrap().iter();
        step["table_force_n"] == 0.0 && fingers.map(|f| f.as_f64().unwrap()).sum::<f64>() > 0.5
    };
    of_step.filter(carries).count()
}

#[test]
fn strawberry_of_ten_node_elements_is_lifted_and_its_lift_replayed() {
    let folder = Folder::new();
    let path = folder.path("ten.mcap");
    let report = lifted(&folder, &["--element", "t10", "--nodes", "100", "--record", &path]);
    assert!(ticks_carried(&report) > 60, "the hand never carried it");
    assert!(report["object"]["nodes"].as_u64().unwrap() > 400, "{}", report["object"]);
    let again = folder.path("replay.json");
    succeed(&["replay", &path, "--check", "--threads", "1", "--report", &again]);
    let replayed: Value = serde_json::from_str(&folder.read("replay.json")).unwrap();
    assert_eq!(replayed["replay"]["difference"], Value::Null);
}

#[test]
fn grasp_by_friction_is_replayed_bit_by_bit() {
    let folder = Folder::new();
    let path = folder.path("lift.mcap");
    lifted(&folder, &["--record", &path]);
    for threads in ["1", "3"] {
        let report = folder.path("replay.json");
        succeed(&["replay", &path, "--check", "--threads", threads, "--report", &report]);
        let replayed: Value = serde_json::from_str(&folder.read("replay.json")).unwrap();
        assert_eq!(replayed["replay"]["difference"], Value::Null);
        assert!(replayed["replay"]["requests"].as_u64().unwrap() > 100, "{}", replayed["replay"]);
    }
}

/// The last step of a run in real time is asked for and never answered; its replay differed there.
#[test]
fn grasp_by_friction_in_real_time_is_replayed_to_its_last_unanswered_step() {
    let folder = Folder::new();
    let path = folder.path("live.mcap");
    lifted(&folder, &["--record", &path, "--rate", "60"]);
    let report = folder.path("replay.json");
    succeed(&["replay", &path, "--check", "--report", &report]);
    let replayed: Value = serde_json::from_str(&folder.read("replay.json")).unwrap();
    assert_eq!(replayed["replay"]["difference"], Value::Null);
}

/// A step goes on with the shape and the factor that the session keeps, and a replay keeps the same ones.
#[test]
fn grasp_at_large_deformation_lifts_and_is_replayed_bit_by_bit() {
    let folder = Folder::new();
    let path = folder.path("large.mcap");
    let of_run =
        ["--nodes", "200", "--grasp", "contact", "--deformation", "large", "--record", &path];
    let report = lifted(&folder, &of_run);
    let all = &report["summary"]["contact"];
    assert_eq!(all["large"], all["steps"], "{all}");
    let carried = report["frames"].as_array().unwrap().iter().filter(|frame| {
        let step = &frame["contact"];
        step["table_force_n"] == 0.0 && step["contacts"].as_u64() > Some(1)
    });
    assert!(carried.count() > 60, "the hand never carried it");
    for threads in ["1", "3"] {
        let told = folder.path("replay.json");
        succeed(&["replay", &path, "--check", "--threads", threads, "--report", &told]);
        let replayed: Value = serde_json::from_str(&folder.read("replay.json")).unwrap();
        assert_eq!(replayed["replay"]["difference"], Value::Null);
    }
}

#[test]
fn grasp_of_clay_leaves_plastic_strain_and_says_how_much() {
    let folder = Folder::new();
    let scene = concat!(env!("CARGO_MANIFEST_DIR"), "/../../scenes/clay-ball.toml");
    let report = lifted(&folder, &["--scene", scene, "--nodes", "200"]);
    let all = &report["summary"]["contact"];
    assert_eq!(all["large"], all["steps"], "{all}");
    assert!(all["plastic_strain_max"].as_f64().unwrap() > 0.02, "{all}");
    let said = fail(
        1,
        &["run", "--headless", "--grasp", "contact", "--yield", "500", "--deformation", "linear"],
    );
    assert!(said.contains("a yield stress needs --deformation large or auto"), "{said}");
}

#[test]
fn thesis_and_contact_do_not_mix_and_it_is_said_why() {
    let said = fail(1, &["run", "--headless", "--grasp", "contact", "--contact", "patch"]);
    assert!(said.contains("--grasp thesis"), "{said}");
    let said = fail(1, &["run", "--headless", "--grasp", "thesis", "--hand", "scripted:lift"]);
    assert!(said.contains("--grasp contact"), "{said}");
}

#[test]
fn series_of_a_run_has_every_tick_with_its_time() {
    let folder = Folder::new();
    let series = folder.path("series");
    let fixed = ["run", "--object", "sphere", "--nodes", "200", "--hand", "scripted:lift"];
    succeed(&[&fixed[..], &["--ticks", "100", "--series", &series]].concat());
    let list = folder.read("series/series.pvd");
    let files: Vec<&str> = list.lines().filter(|line| line.contains("<DataSet")).collect();
    assert_eq!(files.len(), 100);
    let time = |line: &str| -> f64 {
        line.split("timestep=\"").nth(1).unwrap().split('"').next().unwrap().parse().unwrap()
    };
    assert!(files.is_sorted_by(|a, b| time(a) < time(b)), "{list}");
    for line in files {
        let name = line.split("file=\"").nth(1).unwrap().split('"').next().unwrap();
        let text = folder.read(&format!("series/{name}"));
        for array in ["Name=\"displacement\"", "Name=\"elastic_displacement\""] {
            assert!(text.contains(array), "{name} has no {array}");
        }
    }
}

#[test]
fn a_scripted_lift_is_felt_by_thumb_and_fingers() {
    let folder = Folder::new();
    let path = folder.path("force.csv");
    let report = lifted(&folder, &["--force", &format!("record:{path}")]);
    let force = &report["force"];
    assert_eq!(force["device"], "record");
    assert!(force["answers"].as_u64() > Some(20), "{force}");
    assert_eq!(force["device_failed"], Value::Null);
    let text = folder.read("force.csv");
    let felt = |finger: &str| {
        let cell = |line: &str, at: usize| line.split(',').nth(at).unwrap().to_owned();
        let of_finger = text.lines().skip(1).filter(|line| cell(line, 1) == finger);
        let size = |line: &str| {
            let part = |at| cell(line, at).parse::<f64>().unwrap();
            part(5).hypot(part(6)).hypot(part(7))
        };
        of_finger.map(size).fold(0.0, f64::max)
    };
    let fingers = ["1", "2", "3", "4"].map(felt);
    assert!(felt("0") > 0.1, "the thumb feels {} N", felt("0"));
    assert!(fingers.iter().any(|force| *force > 0.1), "{fingers:?}");
    assert!(force["force_max_n"].as_f64().unwrap() <= 3.0 + 1e-9, "{force}");
}

#[test]
fn forces_want_contact_with_friction_and_a_device() {
    let said = fail(2, &["run", "--headless", "--force", "falcon"]);
    assert!(said.contains("names no device"), "{said}");
    let said = fail(1, &["run", "--headless", "--grasp", "thesis", "--force", "record:f.csv"]);
    assert!(said.contains("--grasp contact"), "{said}");
}
