//! Objects of several materials: `solve`, `run` and `press` with regions of the mesh file and of a scene.

use std::fmt::Write as _;

use glove_client::object::mesh_file::encode_mesh;
use glove_client::object::region_choice::{Ellipsoid, MeshOfRegions, RegionChoice};
use softgrasp_core::mesh::{BuiltIn, Surface, TetMesh, generate};

use crate::start::{Folder, displacements, fail, succeed};

/// A cube of edge 1 whose halves along x are the regions `left` and `right`, written as a mesh file.
fn halves(folder: &Folder) -> (String, TetMesh) {
    let cube = generate(BuiltIn::Cube, 343).unwrap();
    let (low, size) = (cube.bounds().0, cube.size());
    let vertices: Vec<_> =
        cube.vertices().iter().map(|p| nalgebra::Point3::from((p - low) / size)).collect();
    let is_right = |tet: &[u32; 4]| {
        let sum: f64 = tet.iter().map(|&n| vertices[n as usize].x).sum();
        u32::from(sum > 2.0)
    };
    let regions = cube.tets().iter().map(is_right).collect();
    let mesh = TetMesh::try_new(vertices, cube.tets().to_vec(), regions).unwrap();
    let path = folder.path("halves.msh");
    let labels = ["left", "right"].map(str::to_owned);
    let bytes = encode_mesh(path.as_ref(), &mesh, &labels, &Surface::from_mesh(&mesh), &[]);
    std::fs::write(&path, bytes.unwrap()).unwrap();
    (path, mesh)
}

/// Both ends held across x, the right one pulled by 1 % along it.
fn pulled(mesh: &TetMesh) -> String {
    let mut table = "node,ux,uy,uz\n".to_owned();
    for (node, p) in mesh.vertices().iter().enumerate() {
        if p.x < 1e-9 {
            writeln!(table, "{node},0,0,0").unwrap();
        } else if p.x > 1.0 - 1e-9 {
            writeln!(table, "{node},0.01,0,0").unwrap();
        }
    }
    table
}

#[test]
fn bar_of_two_materials_stretches_as_two_springs_in_a_row() {
    let folder = Folder::new();
    let (mesh_file, mesh) = halves(&folder);
    folder.write("K.csv", &pulled(&mesh));
    let [known, out] = ["K.csv", "U.csv"].map(|name| folder.path(name));
    let deck = folder.path("deck.inp");
    let fixed = ["solve", "--mesh", &mesh_file, "--known", &known, "--out", &out, "--poisson", "0"];
    let stiff = ["--young", "1e4", "--material-region", "right:3e4:0", "--export-deck", &deck];
    succeed(&[&fixed[..], &stiff].concat());
    // The left half, of a third of the stiffness, takes three quarters of the way.
    for (node, u) in displacements(&folder.read("U.csv")) {
        let x = mesh.vertices()[node].x;
        let exact = if x < 0.5 { 0.015 * x } else { 0.0075 + 0.005 * (x - 0.5) };
        assert!((u[0] - exact).abs() < 1e-12, "node {node} at {x}: {u:?}");
    }
    let deck = folder.read("deck.inp");
    assert!(deck.contains("*ELASTIC\n1e4,0e0\n") && deck.contains("*ELASTIC\n3e4,0e0\n"), "{deck}");
}

#[test]
fn region_that_is_not_there_is_told_with_those_that_are() {
    let folder = Folder::new();
    let (mesh_file, mesh) = halves(&folder);
    folder.write("K.csv", &pulled(&mesh));
    let [known, out] = ["K.csv", "U.csv"].map(|name| folder.path(name));
    let fixed = ["solve", "--mesh", &mesh_file, "--known", &known, "--out", &out];
    let said = fail(1, &[&fixed[..], &["--material-region", "bone:1e9:0.3"]].concat());
    assert!(said.contains("the object has no region bone; it has left, right"), "{said}");
    let said = fail(2, &[&fixed[..], &["--material-region", "left:1e9"]].concat());
    assert!(said.contains("ID:E:NU is expected"), "{said}");
    let said = fail(2, &[&fixed[..], &["--material-region", "left:1e9:0.5"]].concat());
    assert!(said.contains("region left"), "{said}");
}

#[test]
fn pit_of_a_scene_is_told_and_a_recording_repeats_it() {
    let folder = Folder::new();
    let scene = concat!(env!("CARGO_MANIFEST_DIR"), "/../../scenes/peach.toml");
    let recording = folder.path("run.mcap");
    let fixed = ["run", "--headless", "--hand", "scripted:squeeze", "--scene", scene];
    let told = succeed(&[&fixed[..], &["--nodes", "600", "--record", &recording]].concat());
    assert!(told.contains("region pit: "), "{told}");
    succeed(&["replay", &recording, "--check"]);
    let empty = folder.write(
        "empty.toml",
        "object = \"sphere\"\n[[region]]\nname = \"pit\"\nyoung_pa = 1e8\npoisson = 0.3\n\
         ellipsoid = { centre_m = [9.0, 0.0, 0.0], radii_m = [0.1, 0.1, 0.1] }\n",
    );
    let said = fail(1, &["run", "--headless", "--scene", &empty]);
    assert!(said.contains("no element lies in its ellipsoid"), "{said}");
}

/// Force of a finger on a ball of 7 cm with a pit, N: a pinch by 4 mm from either side.
fn pinch_force(folder: &Folder, more: &[&str]) -> f64 {
    let [mesh, bodies, report] = ["peach.msh", "bodies.toml", "r.json"].map(|f| folder.path(f));
    let fixed = ["press", "--mesh", &mesh, "--bodies", &bodies, "--report", &report];
    succeed(&[&fixed[..], &["--gravity", "0,0,0", "--viscosity", "0.01"], more].concat());
    let report: serde_json::Value = serde_json::from_str(&folder.read("r.json")).unwrap();
    let last = report["steps"].as_array().unwrap().last().unwrap();
    last.pointer("/bodies/left/force/0").and_then(serde_json::Value::as_f64).unwrap()
}

#[test]
fn pinch_presses_harder_on_a_ball_with_a_pit() {
    let folder = Folder::new();
    let mesh = generate(BuiltIn::Sphere, 800).unwrap();
    let half = 0.5 * mesh.size();
    let radii_m = [0.6 * half; 3];
    let pit = RegionChoice {
        name: "pit".to_owned(),
        young_pa: 1.0,
        poisson: 0.0,
        ellipsoid: Some(Ellipsoid { centre_m: [0.0; 3], radii_m }),
    };
    let made = MeshOfRegions::try_new(mesh, &["flesh".to_owned()], &[pit]).unwrap();
    let path = folder.path("peach.msh");
    let surface = Surface::from_mesh(&made.mesh);
    let bytes = encode_mesh(path.as_ref(), &made.mesh, made.regions.names(), &surface, &[]);
    std::fs::write(&path, bytes.unwrap()).unwrap();
    let finger = |name: &str, side: f64| {
        let [open, closed] = [half + 0.012, half + 0.006].map(|x| side * x);
        format!(
            "[[body]]\nname = \"{name}\"\nshape = \"sphere\"\nradius = 0.01\n\
             poses = [[0, {open}, 0, 0, 1, 0, 0, 0], [0.2, {closed}, 0, 0, 1, 0, 0, 0]]\n"
        )
    };
    folder.write(
        "bodies.toml",
        &format!("end = 0.3\n{}{}", finger("left", -1.0), finger("right", 1.0)),
    );
    let of_flesh = pinch_force(&folder, &[]);
    let same = pinch_force(&folder, &["--material-region", "pit:2e4:0.4"]);
    assert!((same - of_flesh).abs() < 1e-9 * of_flesh.abs(), "{same} N and {of_flesh} N");
    let with_pit = pinch_force(&folder, &["--material-region", "pit:2e7:0.3"]);
    assert!(of_flesh > 0.0 && with_pit > 1.1 * of_flesh, "{with_pit} N, {of_flesh} N of flesh");
}
