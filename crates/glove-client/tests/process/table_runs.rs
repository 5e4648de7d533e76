//! Runs with several objects on one table, and what is refused with them.

use serde_json::Value;

use crate::start::{Folder, fail, succeed};

/// Report of a run with a ball in the middle and a cube to its right.
fn of_two(folder: &Folder, more: &[&str]) -> Value {
    let report = folder.path("table.json");
    let objects = ["--object", "sphere", "--object", "cube", "--object-size", "0.06"];
    let run = ["run", "--headless", "--threads", "2", "--nodes", "200", "--report", &report];
    succeed(&[&run[..], &objects, more].concat());
    serde_json::from_str(&folder.read("table.json")).unwrap()
}

fn frames(report: &Value) -> impl Iterator<Item = &Value> {
    report["frames"].as_array().unwrap().iter()
}

#[test]
fn report_has_a_record_of_every_object_and_the_keys_of_the_first_where_they_were() {
    let folder = Folder::new();
    let report = of_two(&folder, &[]);
    assert_eq!(report["object"]["name"], "sphere");
    let steps = frames(&report).filter(|frame| !frame["contact"].is_null()).count();
    assert!(steps > 100, "{steps} steps of the first");
    let [second] = &report["further_objects"].as_array().unwrap()[..] else { panic!("{report}") };
    assert_eq!((&second["number"], &second["object"]["name"]), (&Value::from(2), &"cube".into()));
    // It bears its own weight on the table and is touched by nobody.
    assert_eq!(second["deforming_ticks"], 0, "{second}");
    let of_second: Vec<&Value> = frames(&report).map(|frame| &frame["further"][0]).collect();
    let last = of_second.iter().rev().find(|record| !record["contact"].is_null()).unwrap();
    assert!(last["contact"]["table_force_n"].as_f64().unwrap() > 0.1, "{last}");
    let place = |key: &str, axis: usize| second[key][axis].as_f64().unwrap();
    assert!(place("home_m", 0) > 0.1, "{second}");
    for axis in 0..3 {
        assert!((place("at_m", axis) - place("home_m", axis)).abs() < 1e-3, "{second}");
    }
}

#[test]
fn second_object_is_lifted_where_that_is_asked_for() {
    let folder = Folder::new();
    let report = of_two(&folder, &["--lifts", "2"]);
    let second = &report["further_objects"][0];
    assert!(second["deforming_ticks"].as_u64().unwrap() > 60, "{second}");
    assert_eq!(second["deforming_ticks"], second["solves"], "every touch is answered in lockstep");
    let carried = frames(&report).filter(|frame| {
        let step = &frame["further"][0]["contact"];
        step["table_force_n"] == 0.0 && step["contacts"].as_u64() > Some(1)
    });
    assert!(carried.count() > 60, "the hand never carried it");
    assert!(frames(&report).all(|frame| frame["state"] != "Deforming"), "the first is touched");
}

#[test]
fn report_of_one_object_says_nothing_of_others() {
    let folder = Folder::new();
    let path = folder.path("one.json");
    let run = ["run", "--headless", "--object", "cube", "--nodes", "64", "--ticks", "20"];
    succeed(&[&run[..], &["--report", &path]].concat());
    let report: Value = serde_json::from_str(&folder.read("one.json")).unwrap();
    assert!(report.get("further_objects").is_none());
    assert!(frames(&report).all(|frame| frame.get("further").is_none()));
}

#[test]
fn scene_of_a_table_has_three_objects_with_what_each_has_of_its_own() {
    let folder = Folder::new();
    let path = folder.path("table.json");
    let scene = concat!(env!("CARGO_MANIFEST_DIR"), "/../../scenes/table.toml");
    let run = ["run", "--headless", "--threads", "2", "--scene", scene, "--nodes", "200"];
    succeed(&[&run[..], &["--ticks", "40", "--report", &path]].concat());
    let report: Value = serde_json::from_str(&folder.read("table.json")).unwrap();
    assert_eq!(report["object"]["name"], "strawberry");
    let further = report["further_objects"].as_array().unwrap();
    let names: Vec<&str> = further.iter().map(|o| o["object"]["name"].as_str().unwrap()).collect();
    assert_eq!(names, ["sphere", "toothpaste"]);
    // The clay is solved at large deformation, the others are not.
    let large: Vec<u64> =
        further.iter().map(|object| object["contact"]["large"].as_u64().unwrap()).collect();
    assert!(large[0] > 0 && large[1] == 0, "{large:?}");
}

#[test]
fn what_does_not_go_with_several_objects_is_refused_by_name() {
    let two = ["run", "--headless", "--object", "cube", "--object", "sphere", "--nodes", "64"];
    for (more, expected) in [
        (&["--grasp", "thesis"][..], "several objects need --grasp contact"),
        (&["--record", "r.mcap"], "--record: a recording holds one object"),
        (&["--series", "s"], "--series"),
        (&["--out-dir", "o"], "--out-dir"),
        (&["--force", "lucid:/dev/none"], "--force: a hand feels one object"),
        (&["--material-region", "a:1e6:0.3"], "[[object.region]]"),
        (&["--lifts", "3"], "--lifts 3: there are 2 objects"),
    ] {
        let said = fail(1, &[&two[..], more].concat());
        assert!(said.contains(expected), "{more:?}: {said}");
    }
    let said = fail(1, &["run", "--headless", "--object", "cube", "--lifts", "2"]);
    assert!(said.contains("there are 1 objects"), "{said}");
}

#[test]
fn objects_that_would_lie_in_each_other_are_refused_by_name() {
    let folder = Folder::new();
    let near = "[[object]]\nshape = \"cube\"\nsize_m = 0.06\n[[object]]\nshape = \"sphere\"\n\
                size_m = 0.06\nat_m = [0.03, 0.0]\n";
    let scene = folder.write("near.toml", near);
    let run = ["run", "--headless", "--nodes", "64", "--scene"];
    let said = fail(1, &[&run[..], &[&scene]].concat());
    assert!(said.contains("object 1, cube, and object 2, sphere"), "{said}");
    let painted = "[[object]]\nshape = \"cube\"\n[[object]]\nshape = \"cube\"\nlook = \"gold\"\n";
    let scene = folder.write("gold.toml", painted);
    let said = fail(1, &[&run[..], &[&scene]].concat());
    assert!(said.contains("the look of cube is 'gold'"), "{said}");
}
