//! Answers of an independent implementation, confirmed by CalculiX, on meshes made by others.

use crate::start::{Folder, displacements, largest, shared, succeed};

#[test]
fn all_sixteen_reference_cases_agree_to_1e_8_of_the_largest_displacement() {
    let (Some(references), Some(meshes)) = (shared("references"), shared("meshes")) else { return };
    let folder = Folder::new();
    let out = folder.path("U.csv");
    let mut cases = 0;
    for entry in std::fs::read_dir(references).unwrap() {
        let case = entry.unwrap().path();
        let name = case.file_name().unwrap().to_str().unwrap();
        // Other folders hold other kinds of cases.
        let Some((mesh, poisson)) = name.rsplit_once('-').filter(|_| case.is_dir()) else {
            continue;
        };
        cases += 1;
        let text = |path: std::path::PathBuf| path.display().to_string();
        let (mesh, known) = (text(meshes.join(mesh)), text(case.join("known.csv")));
        succeed(&[
            "solve",
            "--mesh",
            &mesh,
            "--known",
            &known,
            "--young",
            "1e5",
            "--poisson",
            poisson,
            "--out",
            &out,
        ]);
        let found = displacements(&folder.read("U.csv"));
        assert!(found.iter().enumerate().all(|(i, (node, _))| i == *node), "{name}: every node");
        let expected =
            displacements(&std::fs::read_to_string(case.join("displacements.csv")).unwrap());
        let scale = largest(&expected);
        let mut worst: f64 = 0.0;
        for (node, u) in &expected {
            for axis in 0..3 {
                worst = worst.max((u[axis] - found[*node].1[axis]).abs() / scale);
            }
        }
        println!("{name}: {worst:.1e} of {scale:.3e}");
        assert!(worst <= 1e-8, "{name}: off by {worst:e} of the largest displacement");
        let listed: Vec<usize> = expected.iter().map(|(node, _)| *node).collect();
        let mut others = found.iter().filter(|(node, _)| listed.binary_search(node).is_err());
        assert!(others.all(|(_, u)| *u == [0.0; 3]), "{name}: nodes in no element stay");
    }
    assert_eq!(cases, 16);
}
