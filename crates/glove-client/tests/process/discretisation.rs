//! The estimate of the mesh's own error, and the choice of the element, through
//! `glove-client solve`.

use serde_json::Value;
use softgrasp_core::mesh::BuiltIn;

use crate::agreement::pushed;
use crate::start::{Folder, displacements, succeed};

/// Solves a pushed cube of about `nodes` nodes with more options; report and displacements.
fn solve(folder: &Folder, nodes: usize, known: &str, more: &[&str]) -> (Value, Vec<[f64; 3]>) {
    let mesh = folder.path("cube.msh");
    succeed(&["mesh", "cube", "--nodes", &nodes.to_string(), "--out", &mesh]);
    let known = folder.write("K.csv", known);
    let (out, report) = (folder.path("U.csv"), folder.path("R.json"));
    let files = ["--mesh", &mesh, "--known", &known, "--out", &out, "--report", &report];
    succeed(&[&["solve"][..], &files[..], more].concat());
    let report = serde_json::from_str(&folder.read("R.json")).unwrap();
    (report, displacements(&folder.read("U.csv")).into_iter().map(|(_, u)| u).collect())
}

const ESTIMATE: &str = "--estimate-discretisation";

#[test]
fn estimate_is_the_difference_between_the_elements_whichever_was_asked_for() {
    let folder = Folder::new();
    let known = pushed(BuiltIn::Cube, 125);
    let (_, linear) = solve(&folder, 125, &known, &[]);
    let (_, quadratic) = solve(&folder, 125, &known, &["--element", "t10"]);
    let sum = |of: &dyn Fn(usize, usize) -> f64| -> f64 {
        (0..linear.len()).flat_map(|n| (0..3).map(move |a| (n, a))).map(|(n, a)| of(n, a)).sum()
    };
    let difference = sum(&|n, a| (linear[n][a] - quadratic[n][a]).powi(2)).sqrt();
    let expected = difference / sum(&|n, a| quadratic[n][a].powi(2)).sqrt();
    assert!(expected > 1e-3, "the mesh is coarse: {expected:e}");
    for element in ["t4", "t10"] {
        let (report, _) = solve(&folder, 125, &known, &["--element", element, ESTIMATE]);
        let estimate = report["discretisation_estimate_rel"].as_f64().unwrap();
        assert!((estimate - expected).abs() <= 1e-5 * expected, "{element}: {estimate:e}");
        let why = report["discretisation_why"].as_str().unwrap();
        assert!(why.contains("estimate, not a bound"), "{why}");
        assert_eq!(report["element"], *element);
    }
}

#[test]
fn finer_meshes_have_smaller_estimates() {
    let folder = Folder::new();
    let estimate = |nodes| {
        let known = pushed(BuiltIn::Cube, nodes);
        let (report, _) = solve(&folder, nodes, &known, &[ESTIMATE]);
        report["discretisation_estimate_rel"].as_f64().unwrap()
    };
    assert!(estimate(1331) < estimate(216));
}

#[test]
fn without_an_estimate_the_report_says_why() {
    let folder = Folder::new();
    let (report, _) = solve(&folder, 64, &pushed(BuiltIn::Cube, 64), &[]);
    assert!(report["discretisation_estimate_rel"].is_null());
    assert!(report["discretisation_why"].as_str().unwrap().contains(ESTIMATE));
    let still = pushed(BuiltIn::Cube, 64).replace("-0.005", "0");
    let (report, _) = solve(&folder, 64, &still, &[ESTIMATE]);
    assert!(report["discretisation_estimate_rel"].is_null());
    assert_eq!(report["discretisation_why"], "nothing moves");
}

#[test]
fn element_auto_follows_the_material_and_the_report_tells_which() {
    let folder = Folder::new();
    let known = pushed(BuiltIn::Cube, 64);
    for (poisson, element) in [("0.3", "t4"), ("0.49", "t10")] {
        let more = ["--element", "auto", "--poisson", poisson];
        let (report, _) = solve(&folder, 64, &known, &more);
        assert_eq!(report["element"], *element);
        assert!(report["chosen_because"].as_str().unwrap().contains("lock"));
    }
}
