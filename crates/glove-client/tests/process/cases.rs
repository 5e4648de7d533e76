//! Several sets of displacements in one request of `glove-client solve`.

use softgrasp_core::mesh::BuiltIn;

use crate::agreement::pushed;
use crate::start::{Folder, displacements, fail, largest, succeed};

/// Table of the same displacements, times `factor`.
fn scaled(table: &str, factor: f64) -> String {
    table.replace("-0.005", &format!("{}", -0.005 * factor))
}

#[test]
fn several_cases_in_one_request_equal_each_of_them_alone() {
    let folder = Folder::new();
    let mesh = folder.path("cube.msh");
    succeed(&["mesh", "cube", "--nodes", "343", "--out", &mesh]);
    let table = pushed(BuiltIn::Cube, 343);
    let cases = [1.0, 2.0, -0.5];
    for (k, factor) in cases.into_iter().enumerate() {
        folder.write(&format!("K{k}.csv"), &scaled(&table, factor));
    }
    let of_case = |name: &str| -> Vec<String> {
        (0..cases.len()).map(|k| folder.path(&format!("{name}{k}.csv"))).collect()
    };
    let [known, out, reactions] = ["K", "U", "R"].map(of_case);
    for method in ["front", "front-mixed", "sparse-cholesky", "pcg"] {
        let report = folder.path("report.json");
        let mut arguments = vec!["solve", "--mesh", &mesh, "--method", method, "--report", &report];
        for k in 0..cases.len() {
            let files = [("--known", &known), ("--out", &out), ("--reactions", &reactions)];
            files.iter().for_each(|(flag, files)| arguments.extend([flag, files[k].as_str()]));
        }
        succeed(&arguments);
        let report: serde_json::Value = serde_json::from_str(&folder.read("report.json")).unwrap();
        assert_eq!(report["outs"].as_array().unwrap().len(), cases.len());
        assert!(report["residual_rel"].as_f64().unwrap() < 1e-12);
        assert!(report["error_estimate_rel"].as_f64().unwrap() < 1e-9);
        for k in 0..cases.len() {
            let (alone, forces) = (folder.path("alone.csv"), folder.path("forces.csv"));
            succeed(&[
                "solve",
                "--mesh",
                &mesh,
                "--method",
                method,
                "--known",
                &known[k],
                "--out",
                &alone,
                "--reactions",
                &forces,
            ]);
            let pairs = [(format!("U{k}.csv"), "alone.csv"), (format!("R{k}.csv"), "forces.csv")];
            for (together, alone) in pairs {
                let together =
                    displacements(&folder.read(&together).replace("fx,fy,fz", "ux,uy,uz"));
                let alone = displacements(&folder.read(alone).replace("fx,fy,fz", "ux,uy,uz"));
                assert_eq!(together.len(), alone.len());
                let scale = largest(&alone);
                for ((node, a), (_, b)) in together.iter().zip(&alone) {
                    let apart = (0..3).map(|i| (a[i] - b[i]).abs()).fold(0.0, f64::max);
                    assert!(apart <= 1e-10 * scale, "{method}, case {k}, node {node}: {apart:e}");
                }
            }
        }
    }
}

#[test]
fn without_estimates_the_answer_has_the_same_digits_and_says_what_is_missing() {
    let folder = Folder::new();
    let [mesh, known, out, short, report] =
        ["cube.msh", "K.csv", "U.csv", "V.csv", "R.json"].map(|name| folder.path(name));
    succeed(&["mesh", "cube", "--nodes", "216", "--out", &mesh]);
    folder.write("K.csv", &pushed(BuiltIn::Cube, 216));
    let solve = ["solve", "--mesh", &mesh, "--known", &known, "--report", &report, "--out"];
    succeed(&[&solve[..], &[&out]].concat());
    let whole: serde_json::Value = serde_json::from_str(&folder.read("R.json")).unwrap();
    succeed(&[&solve[..], &[&short, "--no-estimate"]].concat());
    let brief: serde_json::Value = serde_json::from_str(&folder.read("R.json")).unwrap();
    assert_eq!(folder.read("U.csv"), folder.read("V.csv"));
    for field in ["condition_estimate", "error_estimate_rel", "max_rotation_deg", "max_strain"] {
        assert!(whole[field].is_number(), "{field}");
        assert!(brief[field].is_null(), "{field}");
    }
}

#[test]
fn cases_that_do_not_fit_together_are_refused_in_one_line() {
    let folder = Folder::new();
    let [mesh, known, other, out, second] =
        ["cube.msh", "K.csv", "L.csv", "U.csv", "V.csv"].map(|name| folder.path(name));
    succeed(&["mesh", "cube", "--nodes", "216", "--out", &mesh]);
    let table = pushed(BuiltIn::Cube, 216);
    folder.write("K.csv", &table);
    folder.write("L.csv", &table.replacen("0,0,0,0\n", "0,0,,0\n", 1));
    let solve = ["solve", "--mesh", &mesh, "--known", &known, "--known"];
    let said = fail(1, &[&solve[..], &[&other, "--out", &out, "--out", &second]].concat());
    assert!(
        said.contains("L.csv leaves free what the first --known prescribes: uy of node 0"),
        "{said}"
    );
    let said = fail(1, &[&solve[..], &[&known, "--out", &out]].concat());
    assert!(said.contains("2 --known and 1 --out"), "{said}");
    let both = ["--out", &out, "--out", &second, "--method", "condensed"];
    let said = fail(1, &[&solve[..], &[&known], &both[..]].concat());
    assert!(said.contains("one case at a time"), "{said}");
    assert!(std::fs::metadata(&out).is_err(), "nothing is written");
}
