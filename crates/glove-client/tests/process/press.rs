//! `glove-client press`: weight on a table, a pinch that lifts, and what it refuses.

use serde_json::Value;

use crate::start::{Folder, displacements, fail, succeed};

const TABLE: &str = "[[body]]\nname = \"table\"\nshape = \"plane\"\nnormal = [0, 0, 1]\n\
                     poses = [[0, 0, 0, -0.035, 1, 0, 0, 0]]\n";

/// Folder with a ball of 7 cm on a table, and these bodies besides.
fn folder(end: f64, bodies: &str) -> Folder {
    let folder = Folder::new();
    succeed(&["mesh", "sphere", "--nodes", "300", "--out", &folder.path("ball.msh")]);
    folder.write("bodies.toml", &format!("end = {end}\n{TABLE}{bodies}"));
    folder
}

fn report(folder: &Folder, more: &[&str]) -> Value {
    let [mesh, bodies, report] = ["ball.msh", "bodies.toml", "r.json"].map(|f| folder.path(f));
    let mut arguments = vec!["press", "--mesh", &mesh, "--bodies", &bodies, "--report", &report];
    arguments.extend(more);
    succeed(&arguments);
    serde_json::from_str(&folder.read("r.json")).unwrap()
}

fn number(value: &Value, path: &str) -> f64 {
    value.pointer(path).and_then(Value::as_f64).unwrap_or_else(|| panic!("{path} in {value}"))
}

/// Poses of two fingertips that close from the sides until 0.6 s, then rise by 3 cm until 1.1 s.
fn pinch(closed: f64) -> String {
    let finger = |name: &str, side: f64| {
        let row = |t: f64, x: f64, z: f64| format!("[{t}, {}, 0, {z}, 1, 0, 0, 0]", side * x);
        format!(
            "[[body]]\nname = \"{name}\"\nshape = \"sphere\"\nradius = 0.01\nfriction = 1.0\n\
             poses = [{}, {}, {}, {}]\n",
            row(0.0, 0.047, 0.0),
            row(0.3, 0.047, 0.0),
            row(0.6, closed, 0.0),
            row(1.1, closed, 0.03),
        )
    };
    finger("left", -1.0) + &finger("right", 1.0)
}

#[test]
fn table_carries_the_weight_of_what_lies_on_it() {
    let folder = folder(1.5, "");
    let out = folder.path("u.csv");
    let report = report(&folder, &["--viscosity", "0.02", "--out", &out]);
    let steps = report["steps"].as_array().unwrap();
    assert_eq!(steps.len(), 150);
    let last = steps.last().unwrap();
    let weight = 9.81 * number(&report, "/mass");
    let carried = number(last, "/bodies/table/force/2");
    assert!((carried - weight).abs() < 1e-3 * weight, "{carried} of {weight} N");
    for step in steps {
        assert!(number(step, "/penetration_max") < 1e-6 * 0.07);
        assert_eq!(step["friction_law"], "coulomb");
    }
    // What is written is where the nodes are in the world: the ball has sunk, and its lowest node
    // is on the table and not in it.
    let mesh = std::fs::read(folder.path("ball.msh")).unwrap();
    let mesh = softgrasp_core::mesh_io::parse("ball", &mesh, &mut |_| None).unwrap().mesh;
    let lowest = displacements(&folder.read("u.csv"))
        .into_iter()
        .map(|(node, u)| mesh.vertices()[node].z + u[2])
        .fold(f64::INFINITY, f64::min);
    assert!((lowest + 0.035).abs() < 1e-7, "{lowest}");
}

#[test]
fn two_fingertips_lift_a_ball_and_let_it_slide_when_they_press_too_little() {
    for (closed, is_lifted) in [(0.033, true), (0.0435, false)] {
        let report = report(&folder(1.6, &pinch(closed)), &["--viscosity", "0.01"]);
        let last = report["steps"].as_array().unwrap().last().unwrap();
        let height = number(last, "/object_pose/2");
        let on_the_table = number(last, "/bodies/table/contacts");
        match is_lifted {
            true => {
                assert!(height > 0.02, "{height}");
                assert_eq!(on_the_table, 0.0);
                let held =
                    number(last, "/bodies/left/force/2") + number(last, "/bodies/right/force/2");
                let weight = 9.81 * number(&report, "/mass");
                assert!((held - weight).abs() < 0.02 * weight, "{held} of {weight} N");
            }
            false => assert!(height < 0.005 && on_the_table > 0.0, "{height}"),
        }
    }
}

#[test]
fn ball_that_yields_keeps_the_dents_of_a_press_and_an_elastic_one_does_not() {
    let finger = |name: &str, side: f64| {
        let row = |t: f64, x: f64| format!("[{t}, {}, 0, 0, 1, 0, 0, 0]", side * x);
        let rows = [row(0.0, 0.046), row(0.2, 0.039), row(0.4, 0.05)].join(", ");
        format!(
            "[[body]]\nname = \"{name}\"\nshape = \"sphere\"\nradius = 0.01\nposes = [{rows}]\n"
        )
    };
    let folder = folder(0.4, &(finger("left", -1.0) + &finger("right", 1.0)));
    let out = folder.path("u.csv");
    let mut dents = Vec::new();
    for more in [&["--deformation", "large"][..], &["--yield", "400"]] {
        let all = ["--gravity", "0,0,0", "--step", "0.02", "--out", &out];
        let report = report(&folder, &[&all[..], more].concat());
        let last = report["steps"].as_array().unwrap().last().unwrap();
        assert_eq!(number(last, "/bodies/left/contacts"), 0.0);
        assert_eq!(number(&report, "/steps_large"), 20.0);
        let u = displacements(&folder.read("u.csv"));
        let most = |sign: f64| u.iter().map(|(_, u)| sign * u[0]).fold(f64::MIN, f64::max);
        // How much the nodes on both sides have come nearer to each other.
        dents.push((most(1.0) + most(-1.0), number(last, "/plastic_strain")));
    }
    let [(elastic, none), (dent, flowed)] = dents[..] else { panic!("two presses") };
    // The fingers have turned the ball a little: that is in its displacement too.
    assert!(elastic < 1e-4 && none == 0.0, "{elastic} m, {none}");
    assert!(dent > 2e-3 && flowed > 0.02, "{dent} m, {flowed}");
}

#[test]
fn series_is_a_file_for_each_step_and_one_that_names_them_all() {
    let folder = folder(0.05, "");
    let series = folder.path("series");
    report(&folder, &["--series", &series]);
    let list = folder.read("series/series.pvd");
    for step in 1..=5 {
        let name = format!("step_{step:05}.vtu");
        assert!(list.contains(&name), "{list}");
        assert!(folder.read(&format!("series/{name}")).contains("elastic_displacement"));
    }
}

#[test]
fn bodies_that_make_no_sense_are_told_by_name() {
    let folder = folder(1.0, "[[body]]\nname = \"tip\"\nshape = \"sphere\"\nposes = []\n");
    let [mesh, bodies] = ["ball.msh", "bodies.toml"].map(|f| folder.path(f));
    let told = fail(1, &["press", "--mesh", &mesh, "--bodies", &bodies]);
    assert!(told.contains("\"tip\": a sphere needs radius"), "{told}");
}

/// An edge of a box that comes down 12 mm into a ball on a table.
#[test]
fn edge_with_a_radius_converges_and_a_sharp_one_that_does_not_is_told() {
    for radius in [0.0, 0.001] {
        let folder = folder(
            0.2,
            &format!(
                "[[body]]\nname = \"edge\"\nshape = \"box\"\nhalf = [0.03, 0.02, 0.01]\n\
                 radius = {radius}\nfriction = 0.8\n\
                 poses = [[0, 0, 0, 0.0565, 0.9239, 0.3827, 0, 0], [0.2, 0, 0, 0.0445, 0.9239, 0.3827, 0, 0]]\n"
            ),
        );
        let [mesh, bodies, file] = ["ball.msh", "bodies.toml", "r.json"].map(|f| folder.path(f));
        let said = succeed(&["press", "--mesh", &mesh, "--bodies", &bodies, "--report", &file]);
        let report: Value = serde_json::from_str(&folder.read("r.json")).unwrap();
        let last = report["steps"].as_array().unwrap().last().unwrap();
        assert!(number(last, "/bodies/edge/normal_force") > 0.1);
        let left = number(&report, "/steps_not_converged");
        assert_eq!(said.contains("edge has sharp edges"), left > 0.0, "{said}");
        assert!(radius == 0.0 || left == 0.0, "{said}");
    }
}

/// Force by which a fingertip is pressed when it has closed on a ball of so many nodes, N.
fn pinching_force(nodes: &str, element: &str) -> f64 {
    let folder = Folder::new();
    succeed(&["mesh", "sphere", "--nodes", nodes, "--out", &folder.path("ball.msh")]);
    folder.write("bodies.toml", &format!("end = 0.7\n{TABLE}{}", pinch(0.041)));
    let report = report(&folder, &["--viscosity", "0.01", "--element", element]);
    assert_eq!(number(&report, "/steps_not_converged"), 0.0, "{element}");
    let steps = report["steps"].as_array().unwrap();
    number(steps.last().unwrap(), "/bodies/left/normal_force")
}

#[test]
fn press_of_ten_node_elements_is_nearer_to_that_of_a_fine_mesh() {
    let fine = pinching_force("6000", "t4");
    let off = |element: &str| (pinching_force("300", element) / fine - 1.0).abs();
    let (four, ten) = (off("t4"), off("t10"));
    assert!(ten < 0.4 * four, "off by {ten}, with four nodes by {four}");
}

#[test]
fn ball_of_ten_node_elements_is_lifted_and_all_its_nodes_are_in_the_picture() {
    let folder = folder(1.6, &pinch(0.035));
    let [table, picture] = ["u.csv", "u.vtu"].map(|file| folder.path(file));
    let options = ["--viscosity", "0.01", "--element", "t10", "--out"];
    let with_table = report(&folder, &[&options[..], &[&table]].concat());
    let last = with_table["steps"].as_array().unwrap().last().unwrap().clone();
    assert!(number(&last, "/object_pose/2") > 0.02, "{last}");
    assert_eq!(number(&last, "/bodies/table/contacts"), 0.0);
    assert_eq!(with_table["element"], "t10");
    // The table has the nodes of the file, the picture those between them too.
    let given = displacements(&folder.read("u.csv")).len();
    assert!((250..=350).contains(&given), "{given}");
    assert!(number(&with_table, "/nodes") > 5.0 * given as f64);
    report(&folder, &[&options[..], &[&picture]].concat());
    let file = std::fs::read(folder.path("u.vtu")).unwrap();
    let mesh = softgrasp_core::mesh_io::parse("u.vtu", &file, &mut |_| None).unwrap().mesh;
    assert_eq!(mesh.node_count() as f64, number(&with_table, "/nodes"));
    assert!(!mesh.mid_edge_nodes().is_empty());
}
