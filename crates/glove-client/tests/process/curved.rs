//! Files of ten-node tetrahedra through `glove-client solve`: their mid-edge nodes are nodes.

use std::fmt::Write as _;

use softgrasp_core::fem::QuadraticMesh;
use softgrasp_core::mesh::{BuiltIn, TetMesh, generate};
use softgrasp_core::mesh_io::{parse, write_msh41, write_vtu};

use crate::start::{Folder, displacements, fail, succeed};

/// A cube whose edges are bent a little along x; mid-edge nodes stand in front of the corners.
fn bent_cube() -> TetMesh {
    let linear = generate(BuiltIn::Cube, 64).unwrap();
    let straight = QuadraticMesh::try_new(&linear).unwrap();
    let (count, edges) = (linear.node_count(), straight.edges().len());
    let mut vertices = straight.vertices().to_vec();
    for p in &mut vertices[count..] {
        p.x += 2e-4 * (700.0 * p.y + 300.0 * p.z).sin();
    }
    vertices.rotate_left(count);
    let number = |n: u32| (n + edges as u32) % (count + edges) as u32;
    let tets = linear.tets().iter().map(|tet| tet.map(number)).collect();
    let middles = straight.tets().iter().map(|tet| std::array::from_fn(|i| number(tet[4 + i])));
    let mesh = TetMesh::try_new(vertices, tets, vec![]).unwrap();
    mesh.with_mid_edge_nodes(middles.collect()).unwrap()
}

/// The lowest fifth held, the highest tenth pushed down, of nodes that `takes` accepts.
fn pushed(mesh: &TetMesh, takes: impl Fn(usize) -> bool) -> String {
    let (low, high) = mesh.bounds();
    let mut table = "node,ux,uy,uz\n".to_owned();
    for (node, p) in mesh.vertices().iter().enumerate().filter(|(node, _)| takes(*node)) {
        match (p.y - low.y) / (high.y - low.y) {
            part if part <= 0.2 => writeln!(table, "{node},0,0,0").unwrap(),
            part if part >= 0.9 => writeln!(table, "{node},,-0.0005,0").unwrap(),
            _ => {}
        }
    }
    table
}

#[test]
fn mid_edge_nodes_are_prescribed_returned_and_written() {
    let folder = Folder::new();
    let mesh = bent_cube();
    let is_corner = mesh.is_corner();
    let known = pushed(&mesh, |_| true);
    let known = folder.write("K.csv", &known);
    let (out, reactions) = (folder.path("U.csv"), folder.path("R.csv"));
    let (vtu, deck) = (folder.path("U.vtu"), folder.path("K.inp"));
    let mut answers = Vec::new();
    for (name, bytes) in [("m.msh", write_msh41(&mesh)), ("m.vtu", write_vtu(&mesh, &[]).unwrap())]
    {
        let file = folder.path(name);
        std::fs::write(&file, bytes).unwrap();
        let asked = ["solve", "--mesh", &file, "--known", &known, "--element", "t10"];
        succeed(&[&asked[..], &["--out", &out, "--reactions", &reactions]].concat());
        answers.push((folder.read("U.csv"), folder.read("R.csv")));
        succeed(&[&asked[..], &["--out", &vtu, "--export-deck", &deck]].concat());
    }
    assert_eq!(answers[0], answers[1]);
    let all = displacements(&answers[0].0);
    assert_eq!(all.len(), mesh.node_count());
    let (low, high) = mesh.bounds();
    let is_high = |node: &usize| mesh.vertices()[*node].y >= low.y + 0.9 * (high.y - low.y);
    let high: Vec<usize> = (0..mesh.node_count()).filter(is_high).collect();
    assert!(high.iter().any(|node| !is_corner[*node]) && high.iter().any(|node| is_corner[*node]));
    high.iter().for_each(|node| assert_eq!(all[*node].1[1], -0.0005));
    let held: Vec<&str> = answers[0].1.lines().skip(1).collect();
    assert!(high.iter().all(|node| held.iter().any(|row| row.starts_with(&format!("{node},")))));
    let written = parse("U.vtu", &std::fs::read(&vtu).unwrap(), &mut |_| None).unwrap();
    assert_eq!(written.mesh, mesh);
    let written = parse("K.inp", folder.read("K.inp").as_bytes(), &mut |_| None).unwrap();
    assert_eq!(written.mesh.mid_edge_nodes(), mesh.mid_edge_nodes());
    assert!(folder.read("K.inp").contains("TYPE=C3D10"));
}

#[test]
fn linear_elements_take_the_corners_of_the_same_file() {
    let folder = Folder::new();
    let mesh = bent_cube();
    let is_corner = mesh.is_corner();
    let file = folder.path("m.msh");
    std::fs::write(&file, write_msh41(&mesh)).unwrap();
    let known = folder.write("K.csv", &pushed(&mesh, |node| is_corner[node]));
    let (out, report) = (folder.path("U.csv"), folder.path("R.json"));
    let estimate = ["--estimate-discretisation", "--report", &report];
    let solve = |known: &str, element: &str| {
        let asked = ["solve", "--mesh", &file, "--known", known, "--element", element];
        succeed(&[&asked[..], &["--out", &out], &estimate[..]].concat());
        let report: serde_json::Value = serde_json::from_str(&folder.read("R.json")).unwrap();
        (displacements(&folder.read("U.csv")), report)
    };
    let (linear, _) = solve(&known, "t4");
    for (node, u) in linear {
        assert!(is_corner[node] || u == [0.0; 3], "{node}");
    }
    let (_, report) = solve(&known, "t10");
    assert!(report["discretisation_estimate_rel"].as_f64().unwrap() > 1e-3, "{report}");
    let all = folder.write("all.csv", &pushed(&mesh, |_| true));
    let (_, report) = solve(&all, "t10");
    assert!(report["discretisation_estimate_rel"].is_null());
    assert!(report["discretisation_why"].as_str().unwrap().contains("is a mid-edge node"));
    let asked = ["solve", "--mesh", &file, "--known", &all, "--element", "t4", "--out", &out];
    let refused = fail(1, &asked);
    assert!(refused.contains("node"), "{refused}");
}
