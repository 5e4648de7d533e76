//! All methods give the same answer through `glove-client solve`.

use std::fmt::Write as _;

use softgrasp_core::mesh::{BuiltIn, generate};

use crate::start::{Folder, displacements, largest, shared, succeed};

const METHODS: [&str; 4] = ["gauss-jordan", "dense-inverse", "dense-cholesky", "sparse-cholesky"];

/// Solves by every method and compares the answers with the first.
fn check(folder: &Folder, mesh: &str, known: &str, poisson: &str) {
    let (out, report) = (folder.path("U.csv"), folder.path("R.json"));
    let answers: Vec<_> = METHODS
        .iter()
        .map(|method| {
            succeed(&[
                "solve",
                "--mesh",
                mesh,
                "--known",
                known,
                "--poisson",
                poisson,
                "--method",
                method,
                "--out",
                &out,
                "--report",
                &report,
            ]);
            let report: serde_json::Value = serde_json::from_str(&folder.read("R.json")).unwrap();
            assert_eq!(report["method"], *method);
            assert!(report["unknown_dofs"].as_u64().unwrap() > 100);
            displacements(&folder.read("U.csv"))
        })
        .collect();
    let scale = largest(&answers[0]);
    assert!(scale > 0.0);
    for (method, answer) in METHODS.iter().zip(&answers).skip(1) {
        assert_eq!(answer.len(), answers[0].len());
        let mut worst: f64 = 0.0;
        for ((_, a), (_, b)) in answers[0].iter().zip(answer) {
            for axis in 0..3 {
                worst = worst.max((a[axis] - b[axis]).abs() / scale);
            }
        }
        println!("{mesh}, Poisson {poisson}, {method}: {worst:.1e}");
        assert!(worst <= 1e-10, "{mesh}, Poisson {poisson}, {method}: {worst:e}");
    }
}

/// Known displacements: the lowest fifth held, the highest tenth pushed down by 5 mm and left free along
/// x.
pub fn pushed(shape: BuiltIn, nodes: usize) -> String {
    let mesh = generate(shape, nodes).unwrap();
    let (low, high) = mesh.bounds();
    let mut table = "node,ux,uy,uz\n".to_owned();
    for (node, p) in mesh.vertices().iter().enumerate() {
        match (p.y - low.y) / (high.y - low.y) {
            part if part <= 0.2 => writeln!(table, "{node},0,0,0").unwrap(),
            part if part >= 0.9 => writeln!(table, "{node},,-0.005,0").unwrap(),
            _ => {}
        }
    }
    table
}

#[test]
fn methods_agree_on_generated_cube_and_strawberry() {
    let folder = Folder::new();
    let known = folder.path("K.csv");
    for (shape, nodes) in [(BuiltIn::Cube, 216), (BuiltIn::Strawberry, 250)] {
        let mesh = folder.path(&format!("{shape}.msh"));
        succeed(&["mesh", shape.name(), "--nodes", &nodes.to_string(), "--out", &mesh]);
        folder.write("K.csv", &pushed(shape, nodes));
        for poisson in ["0.3", "0.49"] {
            check(&folder, &mesh, &known, poisson);
        }
    }
}

#[test]
fn methods_agree_on_a_liver_made_by_others() {
    let (Some(references), Some(meshes)) = (shared("references"), shared("meshes")) else { return };
    let folder = Folder::new();
    let mesh = meshes.join("liver.msh1.msh").display().to_string();
    for poisson in ["0.3", "0.49"] {
        let case = references.join(format!("liver.msh1.msh-{poisson}"));
        check(&folder, &mesh, &case.join("known.csv").display().to_string(), poisson);
    }
}
